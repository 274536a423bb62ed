"""Regions under DoI: what is written of them is what is read."""

from reviewer.doi import Region
from reviewer.masks import empty_rle
from reviewer.store.regions import StoredIntegration, load_regions
from reviewer.store.results import StageResult, save_results

EMPTY = empty_rle(120, 160)
MADE = (
    Region((3, 5), (1,), 7, 1, 0.25, 0.75, "adopt", False, "between_thresholds", (4, 5, 40, 60)),
    Region((), (0, 2), 0, 0, 0.5, 0.0, "keep", True, "seen_in_reference", None),
)


def test_a_region_is_read_as_it_was_written(db, run, tiny_split):
    pair = tiny_split[0]
    integration = StoredIntegration(MADE, EMPTY, EMPTY)
    save_results(db, run.id, pair.id, [StageResult("integrate", "made up", 0.0, integration)])
    found = load_regions(db, run.id, pair.id)
    assert tuple(each.region for each in found) == MADE
    assert found[0].region.inspect is False and found[1].region.inspect is True
    assert [(each.number, each.verdict, each.comment) for each in found] == [
        (0, None, ""),
        (1, None, ""),
    ]
