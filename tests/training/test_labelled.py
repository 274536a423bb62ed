"""Training pairs cut from ground truth: what is learnt from, what is not, and what stays apart."""

import cv2
import numpy as np
import pytest
import torch
from scenes import textured

from reviewer.errors import InvalidInput
from reviewer.models.nets.build import build_net
from reviewer.models.nets.checkpoints import NetRecord, save_checkpoint
from reviewer.synthesis.bank import Bank, Cutout
from reviewer.synthesis.pairs import TRAINING, VALIDATION
from reviewer.synthesis.settings import SynthesisSettings
from reviewer.training.labelled import LabelledData, LabelledFiles, LabelledPairs, MixedPairs
from reviewer.training.loop import Fit
from reviewer.training.session import train
from reviewer.training.settings import TrainingSettings
from reviewer.training.stream import CHANGED, IGNORED, NumberedPairs, SyntheticData

TINY = TrainingSettings(
    "cdnet", 0.125, iterations=2, batch=2, crop_px=64, validate_every=2, validation_pairs=2,
    precision="float32",
)  # fmt: skip


@pytest.fixture
def files(tmp_path):
    """Two pairs: a changed square with an ignored rim in each."""
    made = []
    for k in range(2):
        past = textured(k)
        live = past.copy()
        levels = np.zeros((120, 160), np.uint8)
        levels[38:62, 48:82] = 255
        levels[40:60, 50:80] = 1
        live[levels == 1] = (230, 20, 20)
        places = [tmp_path / f"{name}{k}.png" for name in ("t0", "t1", "mask")]
        for place, picture in zip(places, (past[..., ::-1], live[..., ::-1], levels), strict=True):
            cv2.imwrite(str(place), picture)
        made.append(LabelledFiles(f"cs1/{k}", *places, f"hash {k}"))
    return made


def pairs_of(files, stream=TRAINING, seed=0):
    return LabelledPairs(files, side=64, seed=seed, stream=stream)


def test_a_numbered_square_is_always_the_same_and_streams_differ(files):
    first, again = pairs_of(files), pairs_of(files)
    assert all(torch.equal(a, b) for k in range(6) for a, b in zip(first[k], again[k], strict=True))
    assert not torch.equal(first[0][0], pairs_of(files, VALIDATION)[0][0])


def test_pictures_and_mask_are_cut_and_mirrored_alike(files):
    pairs = pairs_of(files, VALIDATION)
    seen = 0
    for k in range(24):
        pictures, classes = pairs[k]
        red = (pictures[3] == 230) & (pictures[4] == 20)
        assert torch.equal(red, classes == CHANGED)
        assert set(classes.unique().tolist()) <= {0, CHANGED, IGNORED}
        seen += bool(red.any())
    # Every other square lies over a change, the others anywhere.
    assert 12 <= seen <= 24


def test_nothing_is_learnt_from_ignored_pixels(files):
    fit = Fit(build_net("cdnet", 0.125), TINY)
    pictures = torch.zeros(2, 6, 64, 64, dtype=torch.uint8)
    classes = torch.full((2, 64, 64), IGNORED)
    classes[:, :8] = 0
    fit._loss(pictures, classes).backward()
    weight = fit.net.state_dict(keep_vars=True)["classifier.weight"]
    assert torch.isfinite(weight.grad).all()
    counts = fit.validate(pairs_of(files, VALIDATION))
    assert counts.ignored > 0
    assert counts.tp + counts.fp + counts.fn + counts.tn + counts.ignored == 2 * 64 * 64


def test_a_training_starts_from_a_checkpoint_of_the_same_net(files, tmp_path):
    data = LabelledData(files[:1], files[1:], {"fold": "a"})
    start = tmp_path / "start.pt"
    save_checkpoint(start, build_net("cdnet", 0.125), NetRecord("cdnet", 0.125))
    done = train(tmp_path / "a", TINY, data, start=start)
    assert done.iteration == 2 and data.parts()["data"]["training"] == 1
    wider = TrainingSettings(**{**TINY.record(), "width": 0.25, "betas": (0.5, 0.999)})
    with pytest.raises(InvalidInput, match=r"is a cdnet of width 0.125 , not of width 0.25"):
        train(tmp_path / "b", wider, data, start=start)
    other = TrainingSettings(**{**TINY.record(), "preprocessing": "imagenet"})
    with pytest.raises(InvalidInput, match="trained with preprocessing bgr_128, not imagenet"):
        train(tmp_path / "c", other, data, start=start)


def test_a_square_larger_than_the_pictures_is_refused(files):
    with pytest.raises(InvalidInput, match=r"pair cs1/\d: a crop of 128 pixels, but it is 160x120"):
        LabelledPairs(files, side=128, seed=0, stream=TRAINING)[0]


class Numbers(NumberedPairs):
    """Says which numbers it was asked for."""

    def __init__(self):
        self.asked = []

    def __getitem__(self, number):
        self.asked.append(number)
        return torch.zeros(1), torch.zeros(1)


def test_a_share_of_the_numbers_is_of_the_other_stream_and_always_the_same():
    first, second = Numbers(), Numbers()
    mixed = MixedPairs(first, second, 0.25, seed=3)
    for number in range(400):
        mixed[number]
    assert sorted(first.asked + second.asked) == list(range(400))
    assert 70 < len(second.asked) < 130
    again = MixedPairs(Numbers(), other := Numbers(), 0.25, seed=3)
    for number in range(400):
        again[number]
    assert other.asked == second.asked


def test_synthetic_pairs_are_mixed_into_training_and_not_into_validation(files, tmp_path):
    cutout = Cutout(np.full((24, 30, 3), 250, np.uint8), np.full((24, 30), 255, np.uint8), "block")
    bank = Bank((cutout, cutout, cutout, cutout), {}, "blocks")
    pasted = SyntheticData([textured(0)], bank, SynthesisSettings(), {"sha256": "of-test"})
    data = LabelledData(files[:1], files[1:], {"fold": "a"}, synthetic=pasted, share=0.5)
    training, validation = data.streams(TINY)
    assert isinstance(training, MixedPairs) and isinstance(validation, LabelledPairs)
    parts = data.parts()
    assert parts["data"]["synthetic"] == "of-test" and parts["data"]["share"] == 0.5
    assert parts["synthesis"] == SynthesisSettings().record()
    assert train(tmp_path / "a", TINY, data).iteration == 2


def test_a_checkpoint_that_was_fitted_to_ground_truth_is_no_start(files, tmp_path):
    data = LabelledData(files[:1], files[1:], {"fold": "cs"})
    train(tmp_path / "a", TINY, data)
    with pytest.raises(InvalidInput, match=r"was fitted to ground truth \(fold cs\), so pairs"):
        train(tmp_path / "b", TINY, data, start=tmp_path / "a" / "best.pt")
