"""Rendered views: kept whole, cut to pieces whose flow and masks stay true."""

import numpy as np
import pytest

from reviewer.errors import InvalidInput
from reviewer.models.warping import warp_image
from reviewer.synthesis.rendered import RenderedViews, load_rendered, piece_of, save_rendered
from reviewer.synthesis.settings import SynthesisSettings
from reviewer.synthesis.views import ViewSettings

HEIGHT, WIDTH, SHIFT = 120, 160, 7
PLAIN = ViewSettings(
    side=96, gamma=1.0, jpeg=0.0,
    look=SynthesisSettings(exposure=1.0, colour_cast=1.0, shade=0.0, noise=0.0, blur_px=0.0),
)  # fmt: skip


def rendered():
    """A ramp seen from two places, SHIFT pixels apart; a thing that came, and one that went."""
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    live = np.dstack([x, y, 0 * x + 30]).astype(np.uint8)
    reference = np.dstack([x - SHIFT, y, 0 * x + 30]).clip(0).astype(np.uint8)
    came, went, left, standing = np.zeros((4, HEIGHT, WIDTH), np.uint8)
    came[50:60, 60:72] = 3
    went[40:50, 90 + SHIFT : 104 + SHIFT] = 2
    left[40:50, 90:104] = 2
    standing[70:80, 70:84] = 5
    live[came > 0] = (250, 250, 250)
    reference[went > 0] = (5, 250, 250)
    flow = np.zeros((HEIGHT, WIDTH, 2), np.float16)
    flow[..., 0] = SHIFT
    seen = np.ones((HEIGHT, WIDTH), bool)
    return RenderedViews(reference, live, flow, seen, came, went, left, standing)


def test_a_file_gives_back_what_was_written(tmp_path):
    save_rendered(tmp_path / "a.npz", rendered())
    again = load_rendered(tmp_path / "a.npz")
    for name in RenderedViews.__slots__:
        assert np.array_equal(getattr(again, name), getattr(rendered(), name)), name


@pytest.mark.parametrize("content", [b"no archive", b""])
def test_a_file_that_holds_something_else_is_refused_by_name(tmp_path, content):
    (tmp_path / "a.npz").write_bytes(content)
    with pytest.raises(InvalidInput, match=r"a\.npz: holds no rendered views"):
        load_rendered(tmp_path / "a.npz")


def test_the_flow_of_a_piece_leads_to_the_same_place_also_when_it_is_mirrored():
    mirrored = set()
    for seed in range(12):
        views = piece_of(rendered(), PLAIN, np.random.default_rng(seed))
        assert views.live.shape == (96, 96, 3) and views.flow.dtype == np.float32
        still = views.seen.copy()
        for change in views.changed:
            still &= ~change.mask
        warped = warp_image(views.reference, views.flow)
        apart = np.abs(warped.astype(int) - views.live)[still].max(axis=1)
        assert np.quantile(apart, 0.99) <= 2
        mirrored.add(float(views.flow[0, 0, 0]))
    assert mirrored == {SHIFT, -SHIFT}


def test_what_came_went_and_stands_is_where_the_pictures_show_it():
    kinds = set()
    for seed in range(12):
        views = piece_of(rendered(), PLAIN, np.random.default_rng(seed))
        for change in views.changed:
            kinds.add(change.came)
            if change.came:
                assert views.live[change.mask].min() > 225 and np.array_equal(
                    change.own, change.mask
                )
            else:
                assert views.reference[change.own][:, 1].min() > 225
        kinds |= {"stands" for _ in views.standing}
    assert kinds == {True, False, "stands"}


def test_what_lies_beyond_the_piece_is_not_seen():
    views = piece_of(rendered(), PLAIN, np.random.default_rng(0))
    columns = np.arange(96) + views.flow[0, 0, 0]
    assert np.array_equal(views.seen.any(axis=0), (columns >= 0) & (columns <= 95))


def test_a_piece_larger_than_the_views_is_refused():
    with pytest.raises(InvalidInput, match=r"160x120 px are smaller than a piece of 200 px"):
        piece_of(rendered(), ViewSettings(side=200), np.random.default_rng(0))
