"""What the frame is told of a pair."""

from reviewer.app.endpoints.details import region_info
from reviewer.doi import Region
from reviewer.records import StoredRegion

TERMS = (7, 1, 0.25, 0.75, "adopt", False, "between_thresholds")


def test_a_region_is_told_with_its_terms_and_the_newest_verdict():
    region = Region((3, 5), (1,), *TERMS, (4, 5, 40, 60))
    stored = StoredRegion(11, 2, region, "cup", "keep", "Ada", "shadow", "of the door")
    f_if = {"adopt": 0.5, "keep": None}
    assert region_info(stored, f_if).model_dump() == {
        "id": 11,
        "number": 2,
        "label": "cup",
        "overlap_px": 7,
        "f_b": 1,
        "iou": 0.25,
        "doi": 0.75,
        "choice": "adopt",
        "inspect": False,
        "reason": "between_thresholds",
        "box_xyxy": (4, 5, 40, 60),
        "has_object": True,
        "f_if": f_if,
        "verdict": "keep",
        "audited_by": "Ada",
        "verdict_reason": "shadow",
        "comment": "of the door",
    }


def test_a_region_without_an_object_says_so():
    stored = StoredRegion(11, 2, Region((), (1,), *TERMS, None), "", None, None)
    told = region_info(stored, {})
    assert (told.has_object, told.box_xyxy, told.verdict) == (False, None, None)
