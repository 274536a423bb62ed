"""Two views of a place: the true flow, what the reference shows, and what came or went."""

from dataclasses import replace
from itertools import combinations

import cv2
import numpy as np
import pytest
from scenes import textured
from tiny_views import block_bank

from reviewer.masks import dilate
from reviewer.models.warping import inside, warp_image, warp_mask
from reviewer.synthesis.bank import Bank, Cutout
from reviewer.synthesis.settings import SynthesisSettings
from reviewer.synthesis.views import LEAST_PX, ViewSettings, make_views

SIDE = 160
STEADY = SynthesisSettings(
    changes=(0, 4), feather_px=(0, 0), shadow=0, exposure=1, colour_cast=1, shade=0, noise=0,
    blur_px=0, colour_match=(0, 0),
)  # fmt: skip
SEEDS = range(12)


def settings(**given):
    """Views that differ by camera and things alone."""
    return ViewSettings(
        **{
            "side": SIDE,
            "gamma": 1.0,
            "jpeg": 0.0,
            "standing_px": (20, 60),
            "look": STEADY,
            **given,
        }
    )


def views(seed, **given):
    backgrounds = textured(seed % 3)
    return make_views(backgrounds, block_bank(), settings(**given), np.random.default_rng(seed))


def changed(made):
    """All that changed, in the live frame, and the rims of what stands there."""
    there = np.zeros((SIDE, SIDE), bool)
    for thing in made.changed:
        there |= thing.mask
    rims = np.zeros((SIDE, SIDE), bool)
    for mask in (*made.standing, *(c.mask for c in made.changed)):
        rims |= dilate(mask, size_px=7) & ~cv2.erode(mask.view(np.uint8), np.ones((7, 7))).view(
            bool
        )
    return there, rims


def off(made, flow):
    """How far the reference, warped, is from the live picture: grey levels (H, W)."""
    warped = warp_image(made.reference, flow)
    return np.abs(warped.astype(np.float32) - made.live).mean(axis=2)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_true_flow_brings_what_is_seen_onto_the_live_picture(seed):
    made = views(seed, still=0.0)
    there, rims = changed(made)
    compared = made.seen & ~there & ~rims
    assert compared.mean() > 0.1
    right = off(made, made.flow)[compared]
    assert np.percentile(right, 90) < 6
    shifted = off(made, made.flow + np.float32(12))[compared]
    assert right.mean() < 0.4 * shifted.mean()


def test_a_standing_thing_moves_as_one_and_its_pattern_is_found_again():
    pattern = np.random.default_rng(0).integers(0, 255, (40, 40, 3), np.uint8)
    bank = Bank((Cutout(pattern, np.full((40, 40), 255, np.uint8), "rug"),), {}, "rugs")
    given, found = settings(look=replace(STEADY, changes=(0, 0)), clutter=0), 0
    for seed in SEEDS:
        made = make_views(textured(0), bank, given, np.random.default_rng(seed))
        _, rims = changed(made)
        for mask in made.standing:
            assert len(np.unique(made.flow[mask], axis=0)) == 1
            inner = mask & made.seen & ~rims
            if inner.any():
                # Half-covered pixels at the rim of another thing are few.
                assert np.median(off(made, made.flow)[inner]) < 3
                found += 1
    assert found > 10


def test_what_a_thing_hides_in_the_reference_is_not_seen():
    hidden, seen = [], []
    for seed in SEEDS:
        made = views(seed, still=0.0, parallax_px=30, look=replace(STEADY, changes=(0, 0)))
        _, rims = changed(made)
        landed = inside(made.flow, SIDE, SIDE)
        there = off(made, made.flow)
        hidden.append(there[landed & ~made.seen & ~rims])
        seen.append(there[made.seen & ~rims])
    behind = np.concatenate(hidden)
    assert len(behind) > 500
    assert np.median(behind) > 5 * np.median(np.concatenate(seen))


@pytest.mark.parametrize("seed", SEEDS)
def test_what_lies_outside_the_reference_is_not_seen(seed):
    made = views(seed, still=0.0, motion=0.3)
    beyond = ~inside(made.flow, SIDE, SIDE)
    # Rounding to the nearest pixel reaches half a pixel over the rim.
    assert not (made.seen & cv2.erode(beyond.view(np.uint8), np.ones((3, 3))).view(bool)).any()


def test_a_camera_that_stands_still_moves_less_than_two_pixels_plus_a_slight_relief():
    moved = [np.abs(views(seed, still=1.0, standing=0, relief_px=0).flow).max() for seed in SEEDS]
    assert max(moved) <= 3.01 + 1e-3
    assert np.abs(views(0, still=0.0, standing=0).flow).max() > 3.01


@pytest.mark.parametrize("seed", SEEDS)
def test_masks_are_apart_visible_and_of_some_size(seed):
    made = views(seed)
    present = [*(c.mask for c in made.changed if c.came), *made.standing]
    for first, second in combinations(present, 2):
        assert not (first & second).any()
    came = np.logical_or.reduce([c.mask for c in made.changed if c.came] or [np.zeros(1, bool)])
    for thing in made.changed:
        assert np.count_nonzero(thing.mask) >= LEAST_PX
        if not thing.came:
            assert not (thing.mask & came).any()
    assert all(np.count_nonzero(mask) >= LEAST_PX for mask in made.standing)


def test_what_went_is_where_the_true_flow_finds_it_in_the_reference():
    found = 0
    for seed in SEEDS:
        made = views(seed, look=replace(STEADY, removal=1.0, changes=(2, 4)))
        for thing in made.changed:
            assert not thing.came
            assert not (thing.mask & ~warp_mask(thing.own, made.flow)).any()
            colour = made.reference[thing.own]
            assert np.ptp(np.median(colour, axis=0)) > 100 or np.median(colour) < 30
            found += 1
    assert found > 10


def test_what_came_is_in_the_live_picture_with_its_own_colour():
    found = 0
    for seed in SEEDS:
        alone = {"moved": 0.0, "standing": 0, "clutter": 0}
        made = views(seed, **alone, look=replace(STEADY, removal=0.0, changes=(2, 4)))
        for thing in made.changed:
            assert thing.came and np.array_equal(thing.mask, thing.own)
            assert off(made, made.flow)[thing.mask].mean() > 10
            found += 1
    assert found > 10


def test_the_same_seed_gives_the_same_bytes_and_another_seed_gives_others():
    def all_of(seed):
        made = make_views(
            textured(0), block_bank(), ViewSettings(side=96), np.random.default_rng(seed)
        )
        parts = [made.reference, made.live, made.flow, made.seen, *made.standing]
        parts += [part for c in made.changed for part in (c.mask, c.own)]
        return b"".join(part.tobytes() for part in parts)

    assert all_of(5) == all_of(5) != all_of(6)


def test_pictures_have_the_side_and_the_types_that_they_promise():
    made = views(1)
    assert made.reference.shape == made.live.shape == (SIDE, SIDE, 3)
    assert made.reference.dtype == made.live.dtype == np.uint8
    assert made.flow.shape == (SIDE, SIDE, 2) and made.flow.dtype == np.float32
    assert made.seen.dtype == np.bool_


@pytest.mark.parametrize("size", [(40, 60), (96, 96), (700, 300)])
def test_a_background_of_any_size_will_do(size):
    background = cv2.resize(textured(0), size[::-1])
    made = make_views(background, block_bank(), settings(), np.random.default_rng(0))
    assert made.live.std() > 5
