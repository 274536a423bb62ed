"""A net is a detector: any size, any company, and the same answer as the module itself."""

from concurrent.futures import ThreadPoolExecutor
from typing import get_args

import numpy as np
import pytest
import torch
from scenes import textured
from torch import nn
from torch.nn import functional

from reviewer.errors import InvalidInput, NotFound
from reviewer.models.detectors.net import NetDetector
from reviewer.models.interfaces import ModelFailed
from reviewer.models.nets.checkpoints import NetRecord, save_checkpoint
from reviewer.models.nets.pictures import pad_to_multiple, prepare, stack_pair
from reviewer.models.nets.windows import through_windows
from reviewer.models.registry import build_detector, open_detector, settings_of
from reviewer.words import NetName

NETS = [*get_args(NetName)]


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory):
    """Paths of tiny random checkpoints by net."""
    folder = tmp_path_factory.mktemp("nets")

    def write(name, **record):
        torch.manual_seed(5)
        path = folder / f"{name}-{'-'.join(record)}.pt"
        save_checkpoint(path, build_detector(name, 0.125), NetRecord(name, 0.125, **record))
        return path

    return write


def _gives_nan(layer, x):
    size = [-(-side // layer.stride[0]) for side in x.shape[2:]]
    return torch.full((len(x), layer.out_channels, *size), torch.nan)


def pair(height, width):
    rng = np.random.default_rng(0)
    reference, live = rng.integers(0, 256, (2, height, width, 3), np.uint8)
    return reference, live, np.ones((height, width), bool)


@pytest.mark.parametrize("name", NETS)
@pytest.mark.parametrize(("height", "width"), [(64, 64), (65, 131), (120, 160)])
def test_any_size_from_64_pixels_gives_probabilities(checkpoint, name, height, width):
    detector = open_detector(name, {"checkpoint": str(checkpoint(name))})
    probability = detector.detect(*pair(height, width))
    assert probability.shape == (height, width) and probability.dtype == np.float32
    assert 0 <= probability.min() < probability.max() <= 1


def test_it_equals_calling_the_module(checkpoint):
    detector = NetDetector("dr-tanet", str(checkpoint("dr-tanet")), precision="float32")
    reference, live, valid = pair(96, 128)
    torch.manual_seed(5)
    net = build_detector("dr-tanet", 0.125).eval()
    inputs = prepare(torch.from_numpy(stack_pair(reference, live))[None], "bgr_128")
    with torch.inference_mode():
        wanted = net(inputs).softmax(1)[0, 1].numpy()
    np.testing.assert_array_equal(detector.detect(reference, live, valid), wanted)


def test_preprocessing_is_what_the_presets_say():
    pictures = torch.zeros(1, 6, 2, 2, dtype=torch.uint8)
    pictures[0, 0], pictures[0, 5] = 255, 128  # red of the reference, blue of live
    bgr = prepare(pictures, "bgr_128")[0, :, 0, 0]
    assert bgr.tolist() == [-1, -1, 255 / 128 - 1, 0, -1, -1]
    imagenet = prepare(pictures, "imagenet")[0, :, 0, 0]
    assert imagenet[0] == pytest.approx((1 - 0.485) / 0.229)
    assert imagenet[5] == pytest.approx((128 / 255 - 0.406) / 0.225)


def test_padding_repeats_the_border_and_only_where_needed():
    pictures = torch.arange(12.0).view(1, 1, 3, 4)
    padded = pad_to_multiple(pictures, 4)
    assert padded.shape == (1, 1, 4, 4) and torch.equal(padded[0, 0, 3], padded[0, 0, 2])
    assert pad_to_multiple(padded, 4) is padded


def test_nothing_is_found_where_nothing_can_be_compared(checkpoint):
    detector = open_detector("cdnet", {"checkpoint": str(checkpoint("cdnet"))})
    reference, live, valid = pair(64, 96)
    valid[:, :40] = False
    first = detector.detect(reference, live, valid)
    assert (first[:, :40] == 0).all() and (first[:, 40:] > 0).any()
    black = np.where(valid[..., None], reference, 0).astype(np.uint8)
    np.testing.assert_array_equal(detector.detect(black, live, valid), first)


def test_windows_cover_the_picture_and_agree_with_themselves():
    pictures = torch.rand(2, 6, 150, 230)

    def look(window):
        assert window.shape == (2, 6, 64, 64)
        return window[:, 0]

    averaged = through_windows(look, pictures, 64)
    torch.testing.assert_close(averaged, pictures[:, 0])
    for side in (64, 128, 256):
        calls = []
        through_windows(lambda w, calls=calls: calls.append(1) or w[:, 0], pictures, side)
        assert len(calls) == {64: 4 * 7, 128: 2 * 3, 256: 1}[side]


def test_a_large_picture_is_shown_in_the_windows_the_checkpoint_names(checkpoint):
    path = str(checkpoint("cscdnet", window_px=64))
    windowed = open_detector("cscdnet", {"checkpoint": path})
    whole = open_detector("cscdnet", {"checkpoint": path, "window": 0})
    assert (windowed.window, whole.window) == (64, 0)
    same, other = pair(64, 64), pair(64, 160)
    np.testing.assert_allclose(windowed.detect(*same), whole.detect(*same), atol=1e-6)
    assert not np.allclose(windowed.detect(*other), whole.detect(*other), atol=1e-3)


def test_polarity_and_threshold_come_with_the_checkpoint(checkpoint):
    plain = open_detector("tanet", {"checkpoint": str(checkpoint("tanet"))})
    turned = open_detector(
        "tanet", {"checkpoint": str(checkpoint("tanet", changed_class=0, threshold=0.3))}
    )
    reference, live, valid = pair(64, 64)
    one, other = (d.detect(reference, live, valid) for d in (plain, turned))
    np.testing.assert_allclose(one + other, 1, atol=1e-6)
    assert (plain.threshold, turned.threshold) == (0.5, 0.3)


def test_bn_mode_batch_uses_the_pair_at_hand_and_forgets_it(checkpoint):
    path = str(checkpoint("cscdnet"))
    batch = open_detector("cscdnet", {"checkpoint": path, "bn_mode": "batch"})
    kept = open_detector("cscdnet", {"checkpoint": path})
    reference, live, valid = pair(64, 64)
    first = batch.detect(reference, live, valid)
    assert not np.allclose(first, kept.detect(reference, live, valid), atol=1e-3)
    batch.detect(live, reference, valid)
    np.testing.assert_array_equal(batch.detect(reference, live, valid), first)
    assert batch.batch == 1


def test_threads_share_the_net_and_get_their_own_pairs(checkpoint):
    detector = open_detector(
        "cdnet", {"checkpoint": str(checkpoint("cdnet")), "batch": 3, "precision": "float32"}
    )
    sizes = [(64, 64), (64, 96)] * 6
    pairs = [pair(*size) for size in sizes]
    for k, (_, live, _) in enumerate(pairs):
        live[:] = textured(k)[: live.shape[0], : live.shape[1]]
    alone = [detector.detect(*each) for each in pairs]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda each: detector.detect(*each), pairs))
    for one, other in zip(alone, together, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-5)


def test_a_pair_that_fails_does_not_take_others_along(checkpoint, monkeypatch):
    detector = open_detector("cdnet", {"checkpoint": str(checkpoint("cdnet"))})
    with pytest.raises(ModelFailed, match="cdnet: needs 64 pixels a side, not 80x63"):
        detector.detect(*pair(63, 80))
    monkeypatch.setattr(nn.Conv2d, "forward", _gives_nan)
    with pytest.raises(ModelFailed, match="cdnet: gave values that are not finite"):
        detector.detect(*pair(64, 64))
    monkeypatch.undo()
    assert detector.detect(*pair(64, 64)).shape == (64, 64)


def test_too_little_memory_fails_the_pair_by_name(checkpoint, monkeypatch):
    detector = open_detector("cdnet", {"checkpoint": str(checkpoint("cdnet"))})

    def full(*_):
        raise torch.OutOfMemoryError("CUDA out of memory")

    monkeypatch.setattr(nn.Conv2d, "forward", full)
    with pytest.raises(ModelFailed, match="cdnet: 1 pairs of 64x64 do not fit into the memory"):
        detector.detect(*pair(64, 64))


def test_a_run_s_settings_hold_what_decides_the_result(checkpoint):
    detector = open_detector("cdnet", {"checkpoint": str(checkpoint("cdnet"))})
    settings = settings_of(detector)
    assert sorted(settings) == [
        "arithmetic",
        "batch",
        "bn_mode",
        "checkpoint",
        "net",
        "precision",
        "weights",
        "window",
    ]
    assert len(settings["weights"]) == 12 and settings["bn_mode"] == "eval"
    assert open_detector("cdnet", settings).weights == settings["weights"]


def test_other_weights_under_the_same_path_are_noticed(checkpoint):
    with pytest.raises(InvalidInput, match="holds other weights"):
        open_detector("cdnet", {"checkpoint": str(checkpoint("cdnet")), "weights": "0" * 12})


def test_without_weights_the_way_out_is_named():
    with pytest.raises(InvalidInput, match="needs trained weights, --detector cscdnet:CHECKPOINT"):
        open_detector("cscdnet")
    with pytest.raises(NotFound, match="no such checkpoint file"):
        open_detector("cscdnet", {"checkpoint": "gone.pt"})


def test_what_a_record_says_is_held_to_as_the_weights_are(checkpoint, tmp_path):
    refined, plain = checkpoint("dr-tanet"), tmp_path / "plain.pt"
    content = torch.load(refined, weights_only=True)
    content["record"]["settings"]["refinement"] = False
    torch.save(content, plain)
    began = settings_of(NetDetector("dr-tanet", str(refined)))
    other = settings_of(NetDetector("dr-tanet", str(plain)))
    assert began["weights"] == other["weights"] and began["arithmetic"] != other["arithmetic"]
    with pytest.raises(
        InvalidInput, match=r"says .*'refinement': False.*, but this run began with"
    ):
        open_detector("dr-tanet", {**began, "checkpoint": str(plain)})


def test_pictures_can_be_squeezed_to_the_square_of_the_training(checkpoint):
    detector = NetDetector("cdnet", str(checkpoint("cdnet", squeeze_px=64)), precision="float32")
    plain = NetDetector("cdnet", str(checkpoint("cdnet")), precision="float32")
    reference, live = textured(1), textured(2)
    valid = np.ones(live.shape[:2], bool)

    def small(picture):
        square = torch.from_numpy(picture).permute(2, 0, 1)[None].float()
        square = functional.interpolate(square, (64, 64), mode="bilinear", antialias=True)
        return square[0].round().byte().permute(1, 2, 0).numpy()

    seen = plain.detect(small(reference), small(live), np.ones((64, 64), bool))
    wanted = functional.interpolate(torch.from_numpy(seen)[None, None], (120, 160), mode="bilinear")
    np.testing.assert_allclose(detector.detect(reference, live, valid), wanted[0, 0], atol=1e-5)
    assert (
        np.abs(detector.detect(reference, live, valid) - plain.detect(reference, live, valid)).max()
        > 0.01
    )


def test_a_net_may_see_the_live_picture_first(checkpoint):
    other = NetDetector("cdnet", str(checkpoint("cdnet", first="live")), precision="float32")
    usual = NetDetector("cdnet", str(checkpoint("cdnet")), precision="float32")
    reference, live, valid = pair(64, 64)
    assert (other.detect(reference, live, valid) == usual.detect(live, reference, valid)).all()
    assert (other.arithmetic, usual.arithmetic) == ({"first": "live"}, {})


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"squeeze_px": 256, "window_px": 64}, "256 beside a window_px of 64"),
        ({"squeeze_px": -1}, "squeeze_px: 0 or positive"),
        ({"first": "both"}, "must be reference or live, but is 'both'"),
    ],
)
def test_how_pictures_are_shown_is_checked(values, message):
    with pytest.raises(InvalidInput, match=message):
        NetRecord("cdnet", **values)


def test_windows_cannot_be_asked_for_where_pictures_are_squeezed(checkpoint):
    with pytest.raises(InvalidInput, match=r"window is 64, but .* are squeezed to 64 pixels"):
        NetDetector("cdnet", str(checkpoint("cdnet", squeeze_px=64)), window=64)


@pytest.mark.parametrize(
    ("name", "source"), [("cscdnet", "`reviewer train` makes some"), ("c3po", "names public ones")]
)
def test_a_net_without_weights_says_where_there_are_some(name, source):
    with pytest.raises(InvalidInput, match=rf"--detector {name}:CHECKPOINT; .*{source}"):
        open_detector(name)
