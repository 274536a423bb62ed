"""The order of proposals, and which are one."""

import numpy as np

from reviewer.editing.ranking import Evidence, Proposal, rank
from reviewer.masks import encode_rle

SHAPE = (60, 80)


def box(x0, y0, x1, y1):
    mask = np.zeros(SHAPE, bool)
    mask[y0:y1, x0:x1] = True
    return mask


def proposed(source, number, mask, region=None, outcome=None):
    return Proposal(
        f"1/{source}/{number}", source, "run", number, "", None, region, encode_rle(mask), outcome
    )


def evidence(final=None, probability=None, chosen=(), seen_before=()):
    return Evidence(
        np.zeros(SHAPE, bool) if final is None else final,
        np.zeros(SHAPE, np.float32) if probability is None else probability,
        frozenset(chosen),
        frozenset(seen_before),
    )


def keys(found):
    return [proposal.key for proposal in found]


THING, OTHER = box(10, 10, 30, 30), box(50, 30, 70, 50)


def test_what_fits_the_final_mask_comes_first():
    found = rank(
        [proposed("detector", k, m) for k, m in enumerate((OTHER, THING))], evidence(THING)
    )
    assert keys(found) == ["1/detector/1", "1/detector/0"]
    assert found[0].likelihood > 0.4 > found[1].likelihood == 0


def test_a_detector_that_is_surer_inside_comes_first():
    probability = np.where(THING, 0.4, 0.1).astype(np.float32)
    both = [proposed("object_live", k, m) for k, m in enumerate((OTHER, THING))]
    assert keys(rank(both, evidence(probability=probability)))[0] == "1/object_live/1"


def test_a_region_whose_object_is_adopted_comes_before_one_that_is_kept():
    regions = [proposed("region", k, m, k) for k, m in enumerate((OTHER, THING))]
    assert keys(rank(regions, evidence(chosen=[1])))[0] == "1/region/1"


def test_what_two_sources_see_comes_before_what_one_sees():
    near = box(13, 10, 33, 30)  # like the thing, but not nearly the same
    some = [
        proposed("detector", 0, OTHER),
        proposed("detector", 1, THING),
        proposed("object_live", 0, near),
    ]
    assert keys(rank(some, evidence()))[:2] == ["1/detector/1", "1/object_live/0"]


def test_what_the_reference_shows_too_comes_last():
    probability = np.full(SHAPE, 0.5, np.float32)
    regions = [proposed("region", k, m, k) for k, m in enumerate((OTHER, THING))]
    assert keys(rank(regions, evidence(probability=probability, seen_before=[0]))) == [
        "1/region/1",
        "1/region/0",
    ]
    things = [
        proposed("object_live", 0, OTHER),
        proposed("object_live", 1, THING),
        proposed("object_reference", 0, box(52, 30, 72, 50)),
    ]
    assert keys(rank(things, evidence(probability=probability)))[0] == "1/object_live/1"


def test_a_speck_comes_after_a_thing():
    probability = np.full(SHAPE, 0.5, np.float32)
    some = [proposed("detector", 0, box(5, 5, 7, 7)), proposed("detector", 1, THING)]
    assert keys(rank(some, evidence(probability=probability)))[0] == "1/detector/1"


def test_near_duplicates_of_several_sources_are_one_and_a_region_stays():
    nearly = box(10, 10, 30, 29)
    some = [
        proposed("detector", 0, THING, outcome="add"),
        proposed("object_live", 0, THING),
        proposed("region", 0, nearly, 7),
        proposed("detector", 1, OTHER),
    ]
    found = rank(some, evidence(THING))
    assert keys(found) == ["1/region/0", "1/detector/1"]
    assert set(found[0].also) == {"detector", "object_live"} and found[0].region_id == 7
    assert found[0].outcome == "add" and found[1].also == ()


def test_one_source_is_never_folded_into_itself():
    same = [proposed("region", k, THING, k) for k in range(2)]
    assert keys(rank(same, evidence())) == ["1/region/0", "1/region/1"]


def test_an_empty_mask_is_listed_last():
    some = [proposed("object_live", 0, box(0, 0, 0, 0)), proposed("detector", 0, THING)]
    assert keys(rank(some, evidence())) == ["1/detector/0", "1/object_live/0"]
