"""DINOv2's early features: the formula, the cut, the shapes of objects, the refusals."""

import cv2
import numpy as np
import pytest
import torch
from checkpoints import write_dinov2, write_sam, write_sam2
from scenes import textured
from transformers import AutoModel

from reviewer.errors import InvalidInput
from reviewer.models.detectors.dinov2 import changed_distance, most_entropy, snap
from reviewer.models.interfaces import Instance, Objects
from reviewer.models.registry import open_detector

REFERENCE = textured(3)
HEIGHT, WIDTH = REFERENCE.shape[:2]
HERE = (slice(40, 72), slice(56, 104))
EVERYWHERE = np.ones((HEIGHT, WIDTH), bool)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_dinov2(tmp_path_factory.mktemp("dinov2"))


@pytest.fixture(scope="module")
def live():
    live = REFERENCE.copy()
    live[HERE] = (230, 20, 20)
    return live


def detector(folder, **settings):
    return open_detector("dinov2", {"checkpoint": str(folder), "blocks": (1, 2), **settings})


def transcribed(folder, warped, live, valid, *, blocks, reach, cut, least, cell=8, before=1):
    """The detector as its page describes it: one place at a time, with the whole net."""
    net = AutoModel.from_pretrained(folder).eval()
    rows, columns = round(HEIGHT / cell), round(WIDTH / cell)
    tokens = []
    for picture in (np.where(valid[..., None], warped, live), live):
        picture = cv2.resize(picture, (columns * 14, rows * 14), interpolation=cv2.INTER_LINEAR)
        picture = (picture / 255.0 - [0.485, 0.456, 0.406]) / [0.229, 0.224, 0.225]
        pixels = torch.tensor(picture.transpose(2, 0, 1)[None], dtype=torch.float32)
        with torch.no_grad():
            state = net.embeddings(pixels)
            after = {}
            for number, layer in enumerate(net.encoder.layer, start=1):
                state = layer(state)
                after[number] = state[0, before:].reshape(rows, columns, -1).numpy()
        tokens.append(after)
    share = cv2.resize(valid.astype(np.float32), (columns, rows), interpolation=cv2.INTER_AREA)
    known = share >= 0.5

    def nearest(mine, other, y, x):
        found = []
        for v in range(max(0, y - reach), min(rows, y + reach + 1)):
            for u in range(max(0, x - reach), min(columns, x + reach + 1)):
                if known[v, u]:
                    a, b = mine[y, x], other[v, u]
                    found.append(1 - a @ b / np.linalg.norm(a) / np.linalg.norm(b))
        return min(found)

    distance = np.zeros((rows, columns))
    for y, x in zip(*np.nonzero(known), strict=True):
        for block in blocks:
            past, present = tokens[0][block], tokens[1][block]
            both = nearest(present, past, y, x), nearest(past, present, y, x)
            distance[y, x] += max(both) / len(blocks)
    limit = max(cut(distance[known].astype(np.float32)), least)
    full = cv2.resize(distance.astype(np.float32), (WIDTH, HEIGHT), interpolation=cv2.INTER_LINEAR)
    return np.where(valid, 1 / (1 + np.exp(-6 * (full / limit - 1))), 0)


def six_deviations(values):
    middle = np.median(values)
    return middle + 6 * 1.4826 * np.median(abs(values - middle))


def entropy_by_trial(values, levels=256):
    """Kapur's cut: both sides of every bin's edge, in plain loops."""
    counts, edges = np.histogram(values, levels, (values.min(), values.max()))
    shares, best = counts / counts.sum(), (-np.inf, 0)
    for k in range(1, levels):
        sides = [part[part > 0] / part.sum() for part in (shares[:k], shares[k:]) if part.any()]
        if len(sides) == 2:
            best = max(best, (-sum((p * np.log(p)).sum() for p in sides), -k))
    return edges[-best[1]]


@pytest.mark.parametrize(
    ("cut", "by_hand"), [("mad", six_deviations), ("entropy", entropy_by_trial)]
)
@pytest.mark.parametrize("registers", [0, 3])
def test_the_probability_is_that_of_the_formula_written_out(
    tmp_path, live, cut, by_hand, registers
):
    folder = write_dinov2(tmp_path / "net", registers=registers)
    valid = EVERYWHERE.copy()
    valid[:, :21] = False
    found = detector(folder, cut=cut, least_distance=0.01).detect(REFERENCE, live, valid)
    wanted = transcribed(
        folder,
        REFERENCE,
        live,
        valid,
        blocks=(1, 2),
        reach=1,
        cut=by_hand,
        least=0.01,
        before=1 + registers,
    )
    assert found.dtype == np.float32 and found.shape == EVERYWHERE.shape
    assert wanted.std() > 0.1, "a probability that hardly varies proves nothing"
    np.testing.assert_allclose(found, wanted, atol=2e-3)


def test_a_new_object_is_found_and_one_that_is_gone_as_well(folder, live):
    for warped, present in ((REFERENCE, live), (live, REFERENCE)):
        found = detector(folder, least_distance=0.5).detect(warped, present, EVERYWHERE) > 0.5
        assert found[HERE].mean() > 0.8
        around = found.copy()
        around[32:80, 48:112] = False
        assert around.mean() < 0.02


def test_a_pair_without_change_has_none(folder):
    assert (detector(folder).detect(REFERENCE, REFERENCE, EVERYWHERE) < 0.5).all()


def test_pixels_outside_the_valid_warp_are_never_changed(folder, live):
    valid = EVERYWHERE.copy()
    valid[HERE] = False
    assert detector(folder).detect(REFERENCE, live, valid)[HERE].max() == 0
    assert detector(folder).detect(REFERENCE, live, ~EVERYWHERE).max() == 0


def test_what_only_moved_within_reach_has_not_changed():
    rng = np.random.default_rng(0)
    past = rng.standard_normal((6, 8, 16)).astype(np.float32)
    past /= np.linalg.norm(past, axis=2, keepdims=True)
    present = np.roll(past, 1, axis=1)
    known = np.ones((6, 8), bool)
    near = changed_distance(past, present, known, 1)
    assert near[:, 1:-1].max() < 1e-5 and near[:, 0].min() > 0.1
    assert changed_distance(past, present, known, 0).min() > 0.1


def test_a_change_in_either_picture_counts():
    past = np.zeros((3, 3, 2), np.float32)
    past[..., 0] = 1
    present = past.copy()
    present[1, 1] = (0, 1)
    known = np.ones((3, 3), bool)
    for a, b in ((past, present), (present, past)):
        distance = changed_distance(a, b, known, 1)
        assert distance[1, 1] == 1 and distance.sum() == 1


def test_the_entropy_cut_lies_between_two_heaps_and_stands_one_value():
    rng = np.random.default_rng(2)
    heaps = np.concatenate([rng.normal(0.2, 0.05, 500), rng.normal(0.8, 0.05, 500)])
    assert 0.3 < most_entropy(heaps.astype(np.float32)) < 0.7
    assert most_entropy(np.full(9, 0.25, np.float32)) == 0.25


def test_changed_places_take_the_shape_of_the_objects_they_fill():
    probability = np.zeros((20, 20), np.float32)
    probability[4:12, 4:12] = 0.9  # an object and a rim around it
    probability[15:18, 15:18] = 0.8  # what no object explains
    thing, table = np.zeros((2, 20, 20), bool)
    thing[5:12, 5:13] = True
    table[:14, :14] = True  # holds the change, and much else
    found = snap(probability, [table, thing], np.ones((20, 20), bool)) > 0.5
    assert (found[:14, :14] == thing[:14, :14]).all()
    assert found[15:18, 15:18].all() and found.sum() == thing.sum() + 9


def test_with_a_sam_the_shapes_are_its_masks(tmp_path, monkeypatch, folder, live):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    sam = write_sam2(tmp_path / "sam2")
    model = detector(folder, sam=f"sam2:{sam}", least_distance=0.5)
    assert len(model.weights.split()) == 2
    shape = np.zeros_like(EVERYWHERE)
    shape[HERE] = True
    seen = []

    def segment(view):
        seen.append((view.live, view.warped))
        return Objects((Instance(shape, "", 1.0),), ())

    monkeypatch.setattr(model._objects, "segment", segment)
    found = model.detect(REFERENCE, live, EVERYWHERE) > 0.5
    assert (found == shape).all()
    assert (seen[0][0] == live).all() and (seen[0][1] == REFERENCE).all()


def test_the_real_sam_is_asked(tmp_path, monkeypatch, folder, live):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    model = detector(folder, sam=f"sam2:{write_sam2(tmp_path / 'sam2')}")
    found = model.detect(REFERENCE, live, EVERYWHERE)
    assert found.shape == EVERYWHERE.shape and 0 <= found.min() and found.max() <= 1


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"blocks": (2, 5)}, r"blocks are \[2, 5\], but .* has 4"),
        ({"blocks": (0,)}, r"blocks are \(0,\), but must be a list of numbers counted from 1"),
        ({"blocks": ()}, "counted from 1"),
        ({"blocks": 3}, r"blocks are 3, but must be a list of .* such as \[3, 6\]"),
        ({"blocks": "3,6"}, "blocks are '3,6', but must be a list"),
        ({"cut": "otsu"}, "cut is 'otsu', but must be entropy or mad"),
        ({"cell_px": 0.5}, "cell_px is 0.5, but must be >= 1"),
        ({"reach": -1}, "reach is -1, but must be >= 0"),
        ({"least_distance": 0}, "least_distance is 0, but must be >= 1e-06"),
        ({"sam": "big"}, "must be sam:PATH or sam2:PATH"),
        ({"weights": "0" * 12}, "holds other weights"),
    ],
)
def test_settings_that_make_no_sense_are_refused(folder, settings, message):
    with pytest.raises(InvalidInput, match=message):
        detector(folder, **settings)


def test_another_model_or_none_is_told(tmp_path):
    with pytest.raises(InvalidInput, match=r"there is no such directory; .*--detector difference"):
        detector(tmp_path / "gone")
    with pytest.raises(InvalidInput, match="holds a model of type 'sam', not dinov2"):
        detector(write_sam(tmp_path / "sam"))


def test_weights_are_told_apart_and_the_run_may_go_on_with_the_same(tmp_path, folder):
    first = detector(folder).weights
    assert detector(folder, weights=first).weights == first
    assert detector(write_dinov2(tmp_path / "other", seed=2)).weights != first
