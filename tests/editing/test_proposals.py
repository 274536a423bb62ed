"""Proposals from every source, and what became of them."""

import numpy as np

from reviewer.editing.proposals import list_proposals, only_in
from reviewer.masks import components, decode_rle, encode_rle
from reviewer.store.layers import load_detection, load_objects
from reviewer.store.regions import load_regions
from reviewer.store.reviews import annotator_id
from reviewer.store.revisions import NewRevision, add_revision, newest_revision


def test_every_source_proposes_its_masks(db, run, tiny_split):
    pair = tiny_split[0]
    found = {
        source: list_proposals(db, pair, run, [source])
        for source in ("region", "detector", "object_live", "object_reference", "prediction")
    }
    regions = load_regions(db, run.id, pair.id)
    assert [p.region_id for p in found["region"]] == [r.id for r in regions]
    assert [p.score for p in found["region"]] == [r.region.doi for r in regions]
    change = decode_rle(load_detection(db, run.id, pair.id).mask)
    assert sum(p.mask.area for p in found["detector"]) == sum(
        crop.area for crop in components(change)[1] if crop.area >= 4
    )
    objects = load_objects(db, run.id, pair.id)
    assert [p.mask for p in found["object_live"]] == [o.mask for o in objects if o.side == "live"]
    assert all(p.outcome is None for group in found.values() for p in group)
    keys = [p.key for group in found.values() for p in group]
    assert len(set(keys)) == len(keys)


def test_the_tool_log_tells_what_became_of_a_proposal(db, run, tiny_split):
    pair, person = tiny_split[0], annotator_id(db, "Ada")
    (region,) = list_proposals(db, pair, run, ["region"])
    mask, number = newest_revision(db, pair.id).mask, newest_revision(db, pair.id).number
    steps = [
        ({"tool": "add", "proposal": region.key}, "add"),
        ({"tool": "reject", "proposal": region.key}, "reject"),
        ({"tool": "undo", "proposal": region.key, "of": "reject"}, "add"),
        ({"tool": "undo", "proposal": region.key, "of": "add"}, None),
    ]
    for step, (action, expected) in enumerate(steps):
        other = np.zeros((120, 160), bool)
        other[step] = True
        drawn = encode_rle(other) if step % 2 else mask
        new = NewRevision(
            pair.id, drawn, number + step, None, person, source="edit", tool_log=[action]
        )
        add_revision(db, new)
        assert list_proposals(db, pair, run, ["region"])[0].outcome == expected


def test_disagreement_is_whole_things_and_thick_parts_but_no_slivers():
    first, second = np.zeros((60, 80), bool), np.zeros((60, 80), bool)
    first[10:30, 10:30] = True
    second[11:31, 11:31] = True  # the same thing, drawn a pixel aside
    first[50:52, 50:52] = True  # a tiny thing that only the first has
    second[40:50, 5:9] = True
    first[10:20, 30:45] = True  # an arm that only the first has
    rest = only_in(first, second)
    assert rest[50:52, 50:52].all() and rest[10:20, 32:45].all()
    assert not rest[20:30, 10:30].any() and not rest[40:50, 5:9].any()
    assert (only_in(second, first) == ((np.indices((60, 80))[0] >= 40) & second)).all()


def test_missed_and_extra_compare_the_prediction_with_the_ground_truth(db, run, tiny_split):
    pair, person = tiny_split[0], annotator_id(db, "Ada")
    mine = np.zeros((120, 160), bool)
    mine[100:110, 10:30] = True
    add_revision(
        db, NewRevision(pair.id, encode_rle(mine), parent=1, annotator_id=person, source="edit")
    )
    (missed,) = list_proposals(db, pair, run, ["missed"])
    (extra,) = list_proposals(db, pair, run, ["extra"])
    assert decode_rle(missed.mask)[45:55, 55:70].all()
    assert decode_rle(extra.mask).sum() == 200


def test_a_batch_of_rejections_counts_for_each_of_its_proposals(db, run, tiny_split):
    pair, person = tiny_split[0], annotator_id(db, "Ada")
    sources = ("region", "detector", "object_live", "object_reference")
    found = list_proposals(db, pair, run, sources)
    keys = [proposal.key for proposal in found]
    mask = newest_revision(db, pair.id).mask
    steps = [
        ({"tool": "reject", "proposals": keys}, "reject"),
        ({"tool": "undo", "of": "reject", "proposals": keys}, None),
    ]
    for parent, (action, expected) in enumerate(steps, start=1):
        new = NewRevision(pair.id, mask, parent, None, person, source="edit", tool_log=[action])
        add_revision(db, new)
        found = list_proposals(db, pair, run, sources)
        assert {proposal.outcome for proposal in found} == {expected}


def test_the_same_thing_from_several_sources_is_listed_once(db, run, tiny_split):
    alone = list_proposals(db, tiny_split[0], run, ["object_live"])
    together = list_proposals(db, tiny_split[0], run, ["region", "object_live"])
    assert len(alone) == len(together) == 1
    assert together[0].source == "region" and together[0].also == ("object_live",)
