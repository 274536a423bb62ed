"""The learnt aligner: the real loading code, the library's own matches, and the flow they make."""

import numpy as np
import pytest
import torch
from checkpoints import write_loftr, write_sam
from scenes import textured
from transformers import EfficientLoFTRForKeypointMatching
from transformers.models.efficientloftr.image_processing_pil_efficientloftr import (
    EfficientLoFTRImageProcessorPil,
)

from reviewer.errors import InvalidInput
from reviewer.models.aligners.matches import LoftrAligner
from reviewer.models.interfaces import ModelFailed
from reviewer.models.registry import build_aligner, settings_of


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A tiny random checkpoint."""
    return write_loftr(tmp_path_factory.mktemp("loftr"))


@pytest.fixture(scope="module")
def aligner(folder):
    return build_aligner(
        "loftr", {"checkpoint": str(folder), "least_score": 0.0, "height": 96, "width": 128}
    )


def grid(height, width, step=12):
    y, x = np.mgrid[step : height - step : step, step : width - step : step]
    return np.stack([x.ravel(), y.ravel()], axis=1).astype(np.float32)


def test_its_matches_are_those_of_the_library(aligner, folder):
    picture = textured(3)[:96, :128]
    source, target = aligner.match(picture, np.roll(picture, 8, axis=1))
    net = EfficientLoFTRForKeypointMatching.from_pretrained(folder).eval()
    processor = EfficientLoFTRImageProcessorPil(size={"height": 96, "width": 128})
    pair = [np.roll(picture, 8, axis=1), picture]
    with torch.inference_mode():
        out = net(**processor(pair, return_tensors="pt"))
    sizes = [[image.shape[:2] for image in pair]]
    (wanted,) = processor.post_process_keypoint_matching(out, sizes, threshold=0.0)
    assert len(source) > 0
    # The library cuts points down to whole pixels.
    np.testing.assert_array_equal(source.astype(int), wanted["keypoints0"].numpy())
    np.testing.assert_array_equal(target.astype(int), wanted["keypoints1"].numpy())


def test_matches_of_a_shift_become_its_flow(aligner):
    source = grid(120, 160)
    flow = aligner.flow_of_matches(source, source + np.float32((5, -3)), 120, 160)
    np.testing.assert_allclose(
        flow[10:-10, 10:-10], np.broadcast_to((5, -3), (100, 140, 2)), atol=0.1
    )


def test_parallax_is_followed_and_wild_matches_are_not(aligner):
    source = grid(240, 320, 6)
    target = source + np.float32((5, -3))
    near = (abs(source[:, 0] - 160) < 40) & (abs(source[:, 1] - 120) < 40)
    target[near] += (7, 0)
    wild = np.arange(len(source)) % 11 == 0
    target[wild & ~near] += 80
    flow = aligner.flow_of_matches(source, target, 240, 320)
    assert flow[120, 160, 0] == pytest.approx(12, abs=0.8)
    assert flow[40, 60] == pytest.approx([5, -3], abs=0.5)


def test_too_few_matches_fail_by_name(aligner):
    blank = np.zeros((120, 160, 3), np.uint8)
    with pytest.raises(ModelFailed, match=r"aligner loftr: .* but 12 are needed"):
        LoftrAligner(aligner.checkpoint, least_score=1.0, height=96, width=128).align(blank, blank)
    rng = np.random.default_rng(0)
    points = rng.uniform(0, 100, (40, 2)).astype(np.float32)
    with pytest.raises(ModelFailed, match="inliers, but 12 are needed"):
        aligner.flow_of_matches(points, rng.permutation(points), 100, 100)


def test_settings_name_the_weights(aligner):
    settings = settings_of(aligner)
    assert settings["weights"] == aligner.weights != ""
    with pytest.raises(InvalidInput, match="holds other weights"):
        build_aligner("loftr", {**settings, "weights": "0" * 12})


def test_a_wrong_checkpoint_is_refused(tmp_path):
    with pytest.raises(InvalidInput, match="no such directory; name a directory or a hub id"):
        build_aligner("loftr", {"checkpoint": str(tmp_path / "gone")})
    with pytest.raises(InvalidInput, match=r"holds a model of type 'sam', not efficientloftr"):
        build_aligner("loftr", {"checkpoint": str(write_sam(tmp_path / "sam"))})
