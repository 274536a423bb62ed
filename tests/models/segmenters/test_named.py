"""Segmenters that search for names: Grounding DINO with SAM or SAM 2, and SAM 3."""

import numpy as np
import pytest
import torch
from checkpoints import write_grounding_dino, write_sam, write_sam2, write_sam3
from scenes import textured
from transformers import GroundingDinoForObjectDetection, GroundingDinoProcessor, Sam3Model

from reviewer.caching import cache_folder
from reviewer.errors import InvalidInput
from reviewer.models.clicks.embeddings import EmbeddingCache
from reviewer.models.clicks.sam import SamClicks
from reviewer.models.interfaces import ClickPictures, PairView
from reviewer.models.registry import build_segmenter, settings_of
from reviewer.models.segmenters.grounding import GroundingDino, _spans
from reviewer.models.warping import warp_mask

LIVE, PAST = textured(4), textured(5)
ALL = np.ones(LIVE.shape[:2], bool)


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    root = tmp_path_factory.mktemp("checkpoints")
    return {
        "dino": write_grounding_dino(root / "dino"),
        "sam": write_sam(root / "sam"),
        "sam2": write_sam2(root / "sam2"),
        "sam3": write_sam3(root / "sam3"),
    }


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    """Embeddings of a test are its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def view(labels=("pen", "wallet"), flow=None, valid=ALL):
    flow = np.zeros((*ALL.shape, 2), np.float32) if flow is None else flow
    return PairView(LIVE, PAST, valid, ALL & False, labels, PAST, flow)


def grounded(folders, sam="sam2", **settings):
    own = {"grounding": str(folders["dino"]), "sam": f"{sam}:{folders.get(sam)}"}
    return build_segmenter("grounded-sam", {**own, "box_threshold": 0.2, **settings})


def test_boxes_and_scores_are_those_of_the_library(folders):
    net = GroundingDinoForObjectDetection.from_pretrained(folders["dino"]).eval()
    processor = GroundingDinoProcessor.from_pretrained(folders["dino"])
    inputs = processor(images=LIVE, text="pen. wallet.", return_tensors="pt")
    with torch.inference_mode():
        out = net(**inputs)
    (wanted,) = processor.post_process_grounded_object_detection(
        out, inputs["input_ids"], threshold=0.3, text_threshold=0.25, target_sizes=[(120, 160)]
    )
    found = GroundingDino(str(folders["dino"]), "test", "").find(LIVE, ["pen", "wallet"], 0.3, 0.25)
    limits = np.array([160, 120, 160, 120])
    boxes = np.clip(wanted["boxes"].numpy(), 0, limits)
    large = (boxes[:, 2:] - boxes[:, :2]).min(axis=1) >= 1
    order = np.argsort(-wanted["scores"].numpy()[large], kind="stable")
    assert len(found) == large.sum() > 0
    np.testing.assert_allclose(
        np.stack([box.box_xyxy for box in found]), boxes[large][order], atol=1e-4
    )
    assert {box.phrase for box in found} <= {"pen", "wallet", ""}


def test_phrases_lie_between_separators():
    assert _spans([101, 336, 1012, 337, 338, 1012, 102]) == [(1, 2), (3, 5)]


def test_a_long_list_of_words_is_read_in_parts(folders):
    dino = GroundingDino(str(folders["dino"]), "test", "")
    words = [f"object number {k}" for k in range(60)]
    groups = dino._groups(words)
    assert len(groups) > 1 and [word for group in groups for word in group] == words
    assert all(len(dino._ids(group)) <= 256 for group in groups)
    assert dino.find(LIVE, words, 0.3, 0.25)


@pytest.mark.parametrize("sam", ["sam", "sam2"])
def test_masks_are_those_of_sam_for_the_boxes(folders, sam):
    found = grounded(folders, sam).segment(view())
    assert len(found.live) > 0
    clicks = SamClicks.load(sam, str(folders[sam]))
    small = EmbeddingCache(clicks, cache_folder("embeddings")).embed(LIVE)
    dino = GroundingDino(str(folders["dino"]), "test", "")
    boxes = dino.find(LIVE, ["pen", "wallet"], 0.2, 0.25)
    masks, _ = clicks.predict_boxes(small, np.stack([box.box_xyxy for box in boxes]))
    wanted = [mask for mask in masks if mask.any()]
    assert len(found.live) == len(wanted)
    for thing, mask in zip(found.live, wanted, strict=True):
        np.testing.assert_array_equal(thing.mask, mask)
    assert all(0 < thing.score <= 1 for thing in found.live)


def test_no_label_and_no_box_find_nothing(folders):
    assert grounded(folders).segment(view(labels=())).live == ()
    nothing = grounded(folders, box_threshold=0.999999).segment(view())
    assert (nothing.live, nothing.reference) == ((), ())


def test_raw_reference_masks_are_warped_into_the_live_frame(folders):
    flow = np.zeros((*ALL.shape, 2), np.float32)
    flow[..., 0] = 7
    valid = ALL.copy()
    valid[:, -7:] = False
    raw = grounded(folders, reference="raw").segment(view(flow=flow, valid=valid)).reference
    unmoved = grounded(folders, reference="warped").segment(view()).reference
    moved = [warp_mask(thing.mask, flow) & valid for thing in unmoved]
    moved = [mask for mask in moved if mask.any()]
    assert len(raw) == len(moved) > 0
    for thing, mask in zip(raw, moved, strict=True):
        np.testing.assert_array_equal(thing.mask, mask)
        # live x shows reference x + 7
        assert not thing.mask[:, -7:].any()


def test_a_pair_that_was_searched_needs_no_embedding_for_a_click(folders, monkeypatch):
    segmenter = grounded(folders)
    segmenter.segment(view())
    clicks = SamClicks.load("sam2", str(folders["sam2"]))
    monkeypatch.setattr(clicks, "embed", lambda *a: pytest.fail("embedded again"))
    cache = EmbeddingCache(clicks, cache_folder("embeddings"))
    for name, picture in (("live", LIVE), ("reference", PAST)):
        assert "map0" in cache.get(name, lambda picture=picture: ClickPictures(picture))


def test_settings_name_the_weights_of_both(folders):
    settings = settings_of(grounded(folders))
    assert "sam2-sam2-" in settings["weights"]
    with pytest.raises(InvalidInput, match="holds other weights"):
        grounded(folders, weights="others")


@pytest.mark.parametrize(
    ("settings", "message"),
    [({"sam": "sam9:x"}, "must be sam:PATH or sam2:PATH"),
     ({"sam": "sam2:/nowhere"}, "there is no such directory"),
     ({"grounding": "/nowhere"}, "there is no such directory"),
     ({"reference": "sideways"}, "must be warped or raw"),
     ({"colour": 1}, "colour")],
)  # fmt: skip
def test_what_cannot_be_loaded_is_refused(folders, settings, message):
    own = {"grounding": str(folders["dino"]), "sam": f"sam2:{folders['sam2']}"}
    with pytest.raises(InvalidInput, match=message):
        build_segmenter("grounded-sam", {**own, **settings})


def test_a_grounding_dino_without_its_processor_is_refused(folders, tmp_path):
    for name in ("config.json", "model.safetensors"):
        (tmp_path / name).write_bytes((folders["dino"] / name).read_bytes())
    with pytest.raises(InvalidInput, match="cannot be loaded"):
        grounded(folders, grounding=str(tmp_path))


def test_sam3_finds_what_its_net_finds(folders):
    segmenter = build_segmenter("sam3", {"checkpoint": str(folders["sam3"]), "least_score": 0.2})
    found = segmenter.segment(view(labels=("pen",))).live
    net = Sam3Model.from_pretrained(folders["sam3"]).eval()
    words = segmenter._tokenizer(
        "pen", return_tensors="pt", padding="max_length", max_length=32, truncation=True
    )
    with torch.inference_mode():
        out = net(pixel_values=segmenter._pixels(LIVE), **words)
    scores = (out.pred_logits.sigmoid() * out.presence_logits.sigmoid())[0]
    chances = out.pred_masks.sigmoid()
    masks = torch.nn.functional.interpolate(chances, LIVE.shape[:2], mode="bilinear")[0] > 0.5
    wanted = [
        (float(score), mask.numpy())
        for score, mask in zip(scores, masks, strict=True)
        if score > 0.2 and mask.any()
    ]
    assert len(found) == len(wanted) > 0
    for thing, (score, mask) in zip(found, wanted, strict=True):
        assert thing.score == pytest.approx(score, abs=1e-5)
        assert (thing.mask != mask).mean() < 1e-3
    assert {thing.label for thing in found} == {"pen"}
    assert segmenter.segment(view(labels=())).live == ()


def test_the_precision_of_the_search_is_recorded_as_it_was(folders):
    assert settings_of(grounded(folders))["precision"] in ("float32", "bfloat16")
    coarse = settings_of(grounded(folders, precision="bfloat16"))
    assert coarse["precision"] == "bfloat16" and coarse["weights"].endswith("-bfloat16")
    assert settings_of(build_segmenter("grounded-sam", coarse)) == coarse
