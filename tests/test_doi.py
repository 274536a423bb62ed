"""The equation, the rule and both scopes, on masks small enough to count by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from reviewer.doi import compose, decide, degree_of_ill_posedness, integrate, integrate_crops
from reviewer.errors import InvalidInput
from reviewer.masks import crop_to_box

SHAPE = (8, 12)
NOTHING = np.zeros(SHAPE, bool)


def block(y0, y1, x0, x1):
    mask = np.zeros(SHAPE, bool)
    mask[y0:y1, x0:x1] = True
    return mask


LIVE = block(0, 2, 0, 4)  # 8 px
HALF = block(0, 2, 0, 2)  # 4 px, inside LIVE: IoU 0.5
FAR = block(6, 8, 8, 12)  # 8 px elsewhere


def test_doi_is_one_minus_iou_when_the_reference_has_no_object_there():
    assert degree_of_ill_posedness(LIVE, FAR, HALF) == pytest.approx(0.5)


def test_doi_is_zero_when_a_single_pixel_was_in_the_reference():
    reference = NOTHING.copy()
    reference[0, 0] = True
    assert degree_of_ill_posedness(LIVE, reference, HALF) == 0.0


def test_overlap_within_the_tolerance_counts_as_none():
    reference = NOTHING.copy()
    reference[0, :2] = True
    assert degree_of_ill_posedness(LIVE, reference, HALF, max_overlap_px=2) == pytest.approx(0.5)
    assert degree_of_ill_posedness(LIVE, reference, HALF, max_overlap_px=1) == 0.0


def test_doi_of_two_empty_masks_is_one_because_zero_over_zero_iou_is_zero():
    assert degree_of_ill_posedness(NOTHING, NOTHING, NOTHING) == 1.0


def test_masks_of_another_size_are_refused_by_name():
    with pytest.raises(InvalidInput, match=r"O_r: must have the size of M_o, 12x8, but is 3x2"):
        degree_of_ill_posedness(LIVE, np.zeros((2, 3), bool), HALF)


def test_masks_that_are_not_boolean_are_refused():
    with pytest.raises(InvalidInput, match="bool with True = changed"):
        degree_of_ill_posedness(LIVE.astype(np.uint8), FAR, HALF)


@pytest.mark.parametrize(
    ("doi", "adopt", "inspect"),
    [(0.0, False, False), (1e-9, True, False), (0.5, True, False), (0.8999, True, False),
     (0.9, False, True), (1.0, False, True)],
)  # fmt: skip
def test_the_rule_is_strict_at_both_ends(doi, adopt, inspect):
    decision = decide(doi)
    assert (decision.adopt, decision.inspect) == (adopt, inspect)


@pytest.mark.parametrize("doi", [-0.1, 1.1, float("nan")])
def test_a_doi_outside_its_range_is_refused(doi):
    with pytest.raises(InvalidInput, match=r"must lie in \[0, 1\]"):
        decide(doi)


def test_low_above_high_is_refused():
    with pytest.raises(InvalidInput, match="low must not exceed high"):
        integrate(HALF, [LIVE], [], low=0.6, high=0.5)


def test_image_scope_is_the_equation_on_whole_masks():
    result = integrate(HALF, [LIVE, FAR], [], scope="image")
    (region,) = result.regions
    assert region.iou == pytest.approx(4 / 16)
    assert (region.doi, region.choice) == (pytest.approx(0.75), "adopt")
    assert (result.mask == (LIVE | FAR)).all()


def test_image_scope_touching_only_leaves_far_objects_out():
    result = integrate(HALF, [LIVE, FAR], [], scope="image", touching_only=True)
    assert (result.mask == LIVE).all()
    assert result.regions[0].object_indices == (0,)


def test_image_scope_keeps_the_detector_when_the_object_was_there_before():
    result = integrate(HALF, [LIVE], [LIVE], scope="image")
    assert result.regions[0].reason == "seen_in_reference"
    assert result.regions[0].overlap_px == 8
    assert (result.mask == HALF).all()


@pytest.mark.parametrize("scope", ["image", "component"])
def test_what_the_reference_shows_too_is_taken_out_where_seen_means_reject(scope):
    result = integrate(HALF, [LIVE], [LIVE], scope=scope, seen="reject")
    (region,) = result.regions
    assert (region.choice, region.reason, region.doi) == ("reject", "seen_in_reference", 0.0)
    assert not result.mask.any()
    assert (compose(HALF, [LIVE], result.regions) == result.mask).all()


def test_rejecting_leaves_what_no_seen_object_touches():
    result = integrate(HALF | FAR, [LIVE], [LIVE], seen="reject")
    assert [r.choice for r in result.regions] == ["reject", "keep"]
    assert (result.mask == FAR).all()


def test_an_adopted_object_stays_where_a_seen_one_takes_its_component_out():
    new, old = block(0, 2, 0, 3), block(1, 2, 1, 5)
    result = integrate(HALF, [new, old], [block(1, 2, 4, 5)], seen="reject")
    assert [r.choice for r in result.regions] == ["adopt", "reject"]
    assert (result.mask == new).all()


@pytest.mark.parametrize("scope", ["image", "component"])
def test_only_what_is_seen_is_rejected(scope):
    hidden = integrate(HALF, [LIVE], [LIVE], scope=scope, valid=~LIVE, seen="reject")
    assert (hidden.regions[0].choice, hidden.regions[0].reason) == ("keep", "outside_warp")
    empty = integrate(NOTHING, [LIVE], [LIVE], scope=scope, seen="reject")
    assert (empty.regions[0].choice, empty.regions[0].reason) == ("keep", "no_detection")
    within = integrate(HALF, [LIVE], [LIVE], scope=scope, max_overlap_px=8, seen="reject")
    assert within.regions[0].choice == "adopt"


@pytest.mark.parametrize("scope", ["image", "component"])
def test_an_empty_detection_gives_an_empty_output(scope):
    result = integrate(NOTHING, [LIVE], [], scope=scope)
    assert not result.mask.any()
    assert [r.reason for r in result.regions] == ["no_detection"]
    assert result.regions[0].choice == "keep"


def test_image_scope_with_nothing_at_all_has_one_empty_region():
    (region,) = integrate(NOTHING, [], [], scope="image").regions
    assert (region.reason, region.doi, region.box_xyxy) == ("no_detection", 1.0, None)


@pytest.mark.parametrize("scope", ["image", "component"])
def test_a_detection_without_any_object_is_kept_and_flagged(scope):
    result = integrate(HALF, [], [], scope=scope)
    (region,) = result.regions
    assert (region.reason, region.doi, region.choice) == ("no_object", 1.0, "keep")
    assert region.inspect
    assert (result.mask == HALF).all()


def test_component_scope_judges_each_object_against_what_it_touches():
    change = HALF | FAR
    result = integrate(change, [LIVE], [])
    adopted, alone = result.regions
    assert (adopted.iou, adopted.doi) == (pytest.approx(0.5), pytest.approx(0.5))
    assert adopted.component_indices == (0,)
    assert (alone.reason, alone.component_indices) == ("no_object", (1,))
    assert (result.mask == (LIVE | FAR)).all()


def test_touching_at_a_corner_is_not_sharing_a_pixel():
    corner = block(2, 4, 2, 4)  # diagonal neighbour of HALF
    touching, alone = integrate(HALF, [corner], []).regions
    assert touching.component_indices == ()
    assert touching.reason == "too_ill_posed"
    assert alone.reason == "no_object"


def test_components_join_over_corners_because_they_are_8_connected():
    change = block(0, 2, 0, 2) | block(2, 4, 2, 4)
    (region,) = integrate(change, [LIVE], []).regions
    assert region.component_indices == (0,)
    assert region.iou == pytest.approx(4 / 12)


def test_an_object_that_equals_its_component_agrees_and_changes_nothing():
    result = integrate(LIVE, [LIVE], [])
    assert (result.regions[0].reason, result.regions[0].doi) == ("agrees", 0.0)
    assert (result.mask == LIVE).all()


def test_the_best_iou_wins_a_shared_component():
    better, worse = block(0, 2, 0, 3), block(0, 4, 0, 4)
    result = integrate(HALF, [worse, better], [])
    assert [r.choice for r in result.regions] == ["keep", "adopt"]
    assert result.regions[0].reason == "better_object"
    assert (result.mask == better).all()


def test_all_adoptable_objects_are_united_when_asked():
    better, worse = block(0, 2, 0, 3), block(0, 4, 0, 4)
    result = integrate(HALF, [worse, better], [], overlaps="all")
    assert [r.choice for r in result.regions] == ["adopt", "adopt"]
    assert (result.mask == worse).all()


def test_pixels_outside_the_valid_warp_do_not_count():
    valid = ~block(0, 2, 2, 4)
    reference = block(0, 2, 3, 4)  # overlaps LIVE only where the warp is not valid
    (region,) = integrate(HALF, [LIVE], [reference], valid=valid).regions
    assert (region.overlap_px, region.f_b, region.iou) == (0, 1, 1.0)


def test_an_object_wholly_outside_the_valid_warp_is_not_judged():
    result = integrate(HALF, [LIVE], [], valid=~LIVE)
    assert result.regions[0].reason == "outside_warp"
    assert (result.regions[0].doi, result.regions[0].choice) == (0.0, "keep")


@pytest.mark.parametrize("scope", ["image", "component"])
def test_a_component_of_which_nothing_can_be_compared_says_nothing(scope):
    (region,) = integrate(HALF, [], [], scope=scope, valid=~HALF).regions
    assert (region.reason, region.f_b, region.doi) == ("outside_warp", 0, 0.0)
    assert (region.choice, region.inspect) == ("keep", False)
    corner = HALF.copy()
    corner[tuple(np.argwhere(HALF)[0])] = False
    (region,) = integrate(HALF, [], [], scope=scope, valid=~corner).regions
    assert (region.reason, region.f_b, region.doi) == ("no_object", 1, 1.0)


def test_scope_image_adopts_no_object_of_which_nothing_can_be_compared():
    result = integrate(HALF, [LIVE, FAR], [], scope="image", valid=~FAR)
    assert result.regions[0].object_indices == (0,)
    assert result.regions[0].choice == "adopt" and (result.mask == LIVE).all()
    nothing = integrate(HALF, [FAR], [], scope="image", valid=~FAR).regions[0]
    assert (nothing.object_indices, nothing.reason) == ((0,), "outside_warp")


def test_unknown_settings_are_refused():
    with pytest.raises(InvalidInput, match="unknown scope 'pixel'"):
        integrate(HALF, [], [], scope="pixel")
    with pytest.raises(InvalidInput, match="unknown seen 'drop'"):
        integrate(HALF, [], [], seen="drop")


def test_a_live_object_of_another_size_is_refused_with_its_number():
    with pytest.raises(InvalidInput, match="live object 1"):
        integrate(HALF, [LIVE, np.zeros((2, 2), bool)], [])


@pytest.mark.parametrize(
    ("verdict", "expected"),
    [("adopt", LIVE | FAR), ("keep", HALF | FAR), ("reject", FAR)],
)
def test_the_final_mask_follows_a_verdict(verdict, expected):
    change = HALF | FAR
    regions = integrate(change, [LIVE], []).regions
    assert (compose(change, [LIVE], regions, {0: verdict}) == expected).all()


@pytest.mark.parametrize("scope", ["image", "component"])
def test_composing_without_verdicts_gives_the_integrated_mask(scope):
    result = integrate(HALF | FAR, [LIVE], [], scope=scope)
    assert (compose(HALF | FAR, [LIVE], result.regions) == result.mask).all()


masks = arrays(np.bool_, SHAPE)


@given(live=masks, reference=masks, change=masks)
def test_doi_lies_between_zero_and_one(live, reference, change):
    assert 0.0 <= degree_of_ill_posedness(live, reference, change) <= 1.0


@given(live=masks, reference=masks, change=masks)
def test_image_scope_equals_the_equation(live, reference, change):
    (region,) = integrate(change, [live], [reference], scope="image").regions
    if live.any() and change.any():
        expected = degree_of_ill_posedness(live, reference, change)
        assert region.doi == pytest.approx(expected)


@given(
    objects=st.lists(masks, max_size=3),
    past=st.lists(masks, max_size=2),
    change=masks,
    valid=masks,
    overlaps=st.sampled_from(["best", "all"]),
)
def test_every_pixel_of_the_output_comes_from_detector_or_objects(
    objects, past, change, valid, overlaps
):
    result = integrate(change, objects, past, valid=valid, overlaps=overlaps)
    allowed = np.logical_or.reduce([change, *objects])
    assert not (result.mask & ~allowed).any()
    assert all(0 <= r.doi <= 1 and 0 <= r.iou <= 1 for r in result.regions)
    assert (compose(change, objects, result.regions) == result.mask).all()
    covered = {n for r in result.regions for n in r.component_indices}
    assert len(covered) == len(integrate(change, [], []).regions) if change.any() else not covered


@pytest.mark.parametrize("scope", ["image", "component"])
def test_masks_by_columns_give_what_masks_by_rows_give(scope):
    rng = np.random.default_rng(5)
    change, live, past, valid = (
        np.kron(rng.random((5, 6)) > 0.4, np.ones((8, 8), bool)) for _ in range(4)
    )
    by_rows = integrate(change, [live], [past], scope=scope, valid=valid)
    turned = [np.asfortranarray(mask) for mask in (change, live, past, valid)]
    by_columns = integrate(turned[0], [turned[1]], [turned[2]], scope=scope, valid=turned[3])
    assert by_columns.regions == by_rows.regions and (by_columns.mask == by_rows.mask).all()
    cut = integrate_crops(
        turned[0], [crop_to_box(turned[1])], turned[2], scope=scope, valid=turned[3]
    )
    assert cut.regions == by_rows.regions
    assert (compose(turned[0], [turned[1]], by_rows.regions) == by_rows.mask).all()
