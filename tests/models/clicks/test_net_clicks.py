"""The click net as a click segmenter: which windows it looks at, and what it may not do."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scenes import HEIGHT, WIDTH, textured
from torch import nn

from reviewer.errors import InvalidInput
from reviewer.masks import intersection_over_union
from reviewer.models.clicks import net_clicks
from reviewer.models.clicks.net_clicks import (
    FIRST_LOOKS,
    MOST_CANDIDATES,
    NARROWER_AND_WIDER,
    SECOND_LOOKS,
    NetClicks,
)
from reviewer.models.clicks.windows import LEAST_SIDE_PX, placed_back, square_around
from reviewer.models.interfaces import Click, Prompt
from reviewer.models.nets.click_net import SIDE, ClickNet
from reviewer.models.nets.small import load_small, save_small
from reviewer.models.registry import build_click_segmenter


class Looks(nn.Module):
    """Stands in for the net: finds what is red in the window, and remembers what it saw."""

    def __init__(self):
        super().__init__()
        self.windows = []
        self.ratings = None

    def forward(self, windows):
        self.windows.append(windows.clone())
        red = windows[:, 0] - windows[:, 1:3].amax(dim=1)
        logits = torch.where(red > 0.5, 4.0, -4.0)
        rating = torch.linspace(1, 0, len(windows)) if self.ratings is None else self.ratings
        return logits, rating[: len(windows)]


@pytest.fixture
def scene():
    """The present and the past of a view, and a red block that came."""
    past = textured(3)
    live, block = past.copy(), np.zeros((HEIGHT, WIDTH), bool)
    block[40:64, 60:90] = True
    live[block] = (250, 20, 20)
    return live, past, block


@pytest.fixture
def looks():
    return Looks()


@pytest.fixture
def segmenter(looks):
    return NetClicks(looks, "of-test")


@pytest.fixture
def squares(monkeypatch):
    """The windows that are looked at, in order."""
    seen = []
    look = net_clicks.look

    def remember(sight, square, clicks, previous):
        seen.append(square)
        return look(sight, square, clicks, previous)

    monkeypatch.setattr(net_clicks, "look", remember)
    return seen


def test_a_first_click_is_looked_at_in_windows_of_every_size_and_the_best_again(
    segmenter, scene, squares, looks
):
    live, past, block = scene
    found = segmenter.predict(segmenter.embed(live, past), Prompt((Click(75, 52),)))
    assert [square.side for square in squares[: len(FIRST_LOOKS)]] == list(FIRST_LOOKS)
    assert {(square.x, square.y) for square in squares[: len(FIRST_LOOKS)]} == {(75, 52)}
    again = squares[len(FIRST_LOOKS) :]
    assert len(again) == SECOND_LOOKS
    around = square_around(block, [Click(75, 52)])
    assert all(abs(square.side - around.side) < 6 for square in again)
    assert [len(windows) for windows in looks.windows] == [len(FIRST_LOOKS), SECOND_LOOKS]
    assert not looks.windows[0][:, 12].any() and looks.windows[1][:, 12].any()
    assert intersection_over_union(found[0].mask, block) > 0.9


def test_a_mask_that_is_cut_by_its_window_is_rated_lower(segmenter, scene, looks, squares):
    live, past, block = scene
    live = live.copy()
    live[10:110, 20:140] = (250, 20, 20)
    looks.ratings = torch.zeros(len(FIRST_LOOKS))
    found = segmenter.predict(segmenter.embed(live, past), Prompt((Click(75, 52),)))
    best = np.zeros_like(block)
    best[10:110, 20:140] = True
    # All windows are rated alike; only the widest shows all of the thing.
    assert intersection_over_union(found[0].mask, best) > 0.9


def test_a_later_click_is_looked_at_a_little_narrower_and_wider_around_mask_and_clicks(
    segmenter, scene, squares, looks
):
    live, past, block = scene
    clicks = (Click(75, 52), Click(20, 100, False))
    segmenter.predict(segmenter.embed(live, past), Prompt(clicks, previous=block))
    around = square_around(block, clicks)
    assert squares == [replace(around, side=around.side * k) for k in NARROWER_AND_WIDER]
    (windows,) = looks.windows
    for window in windows:
        assert window[10].any() and window[11].any() and window[12].any()


def test_a_correction_is_what_its_windows_find_on_average(segmenter, scene, monkeypatch):
    live, past, block = scene
    shares = iter([0.1, 0.6, 0.9])
    monkeypatch.setattr(
        segmenter.net, "forward",
        lambda windows: (
            torch.logit(torch.stack([torch.full((SIDE, SIDE), next(shares)) for _ in windows])),
            torch.full((len(windows),), 0.3),
        ),
    )  # fmt: skip
    (found,) = segmenter.predict(segmenter.embed(live, past), Prompt((Click(75, 52),), None, block))
    _, narrow = placed_back(np.ones((SIDE, SIDE), np.float32), squares_of(block)[0], block.shape)
    assert found.mask[narrow].all()
    assert found.score == pytest.approx(torch.sigmoid(torch.tensor(0.3)).item())


def squares_of(mask):
    """The windows of a correction of a mask by a click in its middle."""
    around = square_around(mask, [Click(75, 52)])
    return [replace(around, side=around.side * share) for share in NARROWER_AND_WIDER]


def test_what_most_first_looks_agree_on_comes_before_a_higher_rated_one(segmenter, scene, looks):
    live, past, block = scene
    far = live.copy()
    # Only the widest look sees this as well.
    far[5:15, 150:170] = (250, 20, 20)
    looks.ratings = torch.tensor([0.0, 0.0, 0.0, 9.0])
    found = segmenter.predict(segmenter.embed(far, past), Prompt((Click(75, 52),)))
    assert intersection_over_union(found[0].mask, block) > 0.9
    assert not found[0].mask[5:15, 150:170].any()


def test_a_correction_keeps_the_mask_outside_its_window(segmenter, scene, monkeypatch):
    live, past, block = scene
    far = np.zeros_like(block)
    far[100:110, 5:15] = True
    # A window that holds the block alone.
    tight = square_around(block, [])
    monkeypatch.setattr(net_clicks, "square_around", lambda mask, clicks: tight)
    found = segmenter.predict(
        segmenter.embed(live, past), Prompt((Click(75, 52),), previous=block | far)
    )
    assert np.array_equal(found[0].mask & far, far)


@pytest.mark.parametrize("click", [Click(-5, -5), Click(WIDTH + 9, 60), Click(0, HEIGHT - 0.1)])
def test_a_click_at_or_beyond_the_rim_is_answered(segmenter, scene, click):
    live, past, _ = scene
    found = segmenter.predict(segmenter.embed(live, past), Prompt((click,)))
    assert 1 <= len(found) <= MOST_CANDIDATES
    assert all(each.mask.shape == (HEIGHT, WIDTH) for each in found)


def test_a_box_is_kept_to_and_stands_for_a_click_in_its_middle(segmenter, scene, squares, looks):
    live, past, block = scene
    box = (55.0, 36.0, 80.0, 70.0)
    found = segmenter.predict(segmenter.embed(live, past), Prompt(box_xyxy=box))
    rows, columns = np.nonzero(found[0].mask)
    assert columns.min() >= 55 and columns.max() < 80 and rows.min() >= 36 and rows.max() < 70
    assert intersection_over_union(found[0].mask, block & (np.arange(WIDTH) < 80)) > 0.9
    _, square, _ = squares
    assert (square.x, square.y) == pytest.approx((67.5, 53), abs=1)
    window = looks.windows[0][1]
    # An ellipse in the box, in a window that is looser than the box.
    assert window[10].any() and 0.15 < window[12].mean() < 0.25


def test_clicked_pixels_are_as_the_clicks_say(segmenter, scene):
    live, past, _ = scene
    clicks = (Click(75, 52), Click(10, 10), Click(70, 50, False))
    for candidate in segmenter.predict(segmenter.embed(live, past), Prompt(clicks)):
        assert candidate.mask[52, 75] and candidate.mask[10, 10] and not candidate.mask[50, 70]


def test_candidates_are_few_different_and_best_first(segmenter, scene, looks):
    live, past, _ = scene
    looks.ratings = torch.tensor([0.0, 2.0, 1.0, -1.0])
    found = segmenter.predict(segmenter.embed(live, past), Prompt((Click(75, 52),)))
    scores = [candidate.score for candidate in found]
    assert scores == sorted(scores, reverse=True) and len(found) <= MOST_CANDIDATES
    for k, first in enumerate(found):
        for second in found[k + 1 :]:
            assert intersection_over_union(first.mask, second.mask) < net_clicks.ALIKE


def test_without_a_reference_nothing_of_another_time_is_shown(segmenter, scene, looks):
    live, _, block = scene
    found = segmenter.predict(segmenter.embed(live, None), Prompt((Click(75, 52),)))
    for windows in looks.windows:
        assert windows[:, :3].any() and not windows[:, 3:10].any()
    assert intersection_over_union(found[0].mask, block) > 0.9


def test_the_net_is_told_how_sure_the_alignment_is(segmenter, scene, looks):
    live, past, _ = scene
    prompt = Prompt((Click(75, 52),))
    segmenter.predict(segmenter.embed(live, past), prompt)
    half = np.full((HEIGHT, WIDTH), 0.5, np.float32)
    segmenter.predict(segmenter.embed(live, past, half), prompt)
    assert (looks.windows[0][:, 9] == 1).all()
    assert looks.windows[2][:, 9].max() == pytest.approx(0.5)


def test_the_net_is_told_what_a_detector_says(segmenter, scene, looks):
    live, past, block = scene
    prompt = Prompt((Click(75, 52),))
    segmenter.predict(segmenter.embed(live, past), prompt)
    segmenter.predict(segmenter.embed(live, past, None, block.astype(np.float32)), prompt)
    assert not looks.windows[0][:, 13].any()
    assert looks.windows[2][0, 13, SIDE // 2, SIDE // 2] == 1


def test_a_tiny_mask_is_looked_at_in_a_window_of_some_size(segmenter, scene, squares):
    live, past, block = scene
    dot = np.zeros_like(block)
    dot[50, 70] = True
    segmenter.predict(segmenter.embed(live, past), Prompt((Click(70.5, 50.5),), previous=dot))
    assert squares[1].side == LEAST_SIDE_PX


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    """Random weights with batch statistics that are not those of the start."""
    torch.manual_seed(0)
    net = ClickNet().train()
    for _ in range(2):
        net(torch.randn(4, 14, SIDE, SIDE))
    path = tmp_path_factory.mktemp("weights") / "click-net.safetensors"
    save_small(path, net, "click-net", {})
    return path


def test_the_net_gives_the_same_with_its_norms_folded_into_its_convolutions(weights):
    plain = ClickNet()
    load_small(weights, plain, "click-net")
    windows = torch.rand(3, 14, SIDE, SIDE)
    with torch.inference_mode():
        wanted, found = plain(windows), NetClicks.load(str(weights)).net(windows)
    for mine, theirs in zip(found, wanted, strict=True):
        torch.testing.assert_close(mine, theirs, rtol=1e-3, atol=1e-3)


def test_it_is_built_by_name_with_and_without_a_file(weights, scene):
    own = build_click_segmenter(f"click-net:{weights}")
    shipped = build_click_segmenter("click-net")
    assert own.model_id != shipped.model_id and own.model_id.startswith("click-net:")
    assert not own.keeps_embeddings
    live, past, _ = scene
    for each in (own, shipped):
        found = each.predict(each.embed(live, past), Prompt((Click(75, 52),)))
        assert found and found[0].mask[52, 75]


def test_a_run_that_began_with_other_weights_is_refused(weights):
    clicks = NetClicks.load(str(weights))
    assert clicks.check("") == clicks.check(clicks.weights) == clicks.weights
    with pytest.raises(InvalidInput, match="click-net"):
        replace(clicks, weights="other").check(clicks.weights)
