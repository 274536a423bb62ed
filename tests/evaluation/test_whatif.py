"""Other rules from stored integers are the rules of `integrate` on masks, to the pixel."""

import itertools

import numpy as np
import pytest
from doi_scenes import HEIGHT, WIDTH, scene
from people import draw

from reviewer.doi import integrate
from reviewer.editing.commit import MaskEdit
from reviewer.evaluation.counting import refresh_counts
from reviewer.evaluation.outcomes import Unsaved, refresh_terms, run_terms
from reviewer.evaluation.rules import Rule, rule_of_run
from reviewer.evaluation.tables import table_lines
from reviewer.evaluation.terms import pair_terms
from reviewer.evaluation.whatif import WhatIf
from reviewer.masks import crop_to_box, encode_rle
from reviewer.metrics import count, f_score, total
from reviewer.store.regions import load_regions
from reviewer.store.scores import split_scores

RULES = [
    Rule(*given)
    for given in itertools.product(
        (0.0, 0.2),
        (0.5, 0.9, 1.1),
        (0, 30),
        ("component", "image"),
        ("best", "all"),
        ("keep", "reject"),
    )
]

SCENES = [scene(seed) for seed in range(24)]
SPLITS = ["a", "b", "c"]


@pytest.fixture(scope="module")
def whatif():
    pairs = []
    for k, (change, live, past, valid, truth, ignore) in enumerate(SCENES):
        reference = np.logical_or.reduce([np.zeros_like(change), *past])
        crops = [crop_to_box(mask) for mask in live]
        terms = pair_terms(change, crops, reference, valid, truth, ignore)
        pairs.append((SPLITS[k % 3], terms))
    return WhatIf(pairs)


def by_masks(rule):
    """Counts pooled by split, from masks."""
    counts = {split: [] for split in SPLITS}
    for k, (change, live, past, valid, truth, ignore) in enumerate(SCENES):
        result = integrate(
            change,
            live,
            past,
            scope=rule.scope,
            valid=valid,
            low=rule.low,
            high=rule.high,
            max_overlap_px=rule.max_overlap_px,
            overlaps=rule.overlaps,
            seen=rule.seen,
        )
        counts[SPLITS[k % 3]].append(count(result.mask, truth, ignore, valid))
    return {split: total(found) for split, found in counts.items()}


def test_every_rule_has_the_counts_of_its_masks(whatif):
    sweep = whatif.sweep(RULES)
    assert sweep.splits == ("a", "b", "c")
    adopted = 0
    for k, rule in enumerate(RULES):
        wanted = by_masks(rule)
        for column, split in enumerate(sweep.splits):
            counts = wanted[split]
            got = (sweep.tp[k, column], sweep.fp[k, column], sweep.truth_px[column])
            assert got == (counts.tp, counts.fp, counts.tp + counts.fn), rule
            assert sweep.f_scores()[k, column] == pytest.approx(f_score(counts))
        adopted += (sweep.tp[k] != whatif.base().tp[0]).any()
    assert adopted > len(RULES) / 2  # the scenes are not trivial


def test_the_base_is_the_detector(whatif):
    base = whatif.base()
    counts = {split: [] for split in SPLITS}
    for k, (change, _, _, valid, truth, ignore) in enumerate(SCENES):
        counts[SPLITS[k % 3]].append(count(change, truth, ignore, valid))
    assert [int(v) for v in base.tp[0]] == [total(counts[split]).tp for split in SPLITS]
    assert [int(v) for v in base.fp[0]] == [total(counts[split]).fp for split in SPLITS]


def test_counts_by_pair_add_up_to_those_of_the_splits(whatif):
    rule = Rule(scope="image", seen="reject")
    counts, sweep = whatif.counts_by_pair(rule), whatif.sweep([rule])
    for k in range(3):
        pooled = total(counts[k::3])
        assert (pooled.tp, pooled.fp) == (sweep.tp[0, k], sweep.fp[0, k])
        assert pooled.tp + pooled.fn == sweep.truth_px[k]


def test_pairs_without_anything_count_nothing():
    empty = np.zeros((HEIGHT, WIDTH), bool)
    whatif = WhatIf([("a", pair_terms(empty, [], empty, None, empty, None))])
    assert whatif.sweep([Rule()]).f_scores().tolist() == [[0.0]]
    assert whatif.oracle().tp.tolist() == [[0]]


def test_terms_follow_the_truth_and_the_masks(db, run, tiny_split):
    assert refresh_terms(db, run) == 3
    assert refresh_terms(db, run) == 0
    before = run_terms(db, run)
    assert before.pair_ids == tuple(pair.id for pair in tiny_split)
    refresh_counts(db)
    (wanted,) = (line.f_score for line in table_lines(split_scores(db, run.name))
                 if line.method == "doi" and line.split == "mean")  # fmt: skip
    assert before.whatif.sweep([rule_of_run(run.settings)]).mean_f()[0] == pytest.approx(wanted)
    empty = encode_rle(np.zeros((120, 160), bool))
    draw(db, tiny_split[0].id, "Ada", MaskEdit(empty, 1))
    assert refresh_terms(db, run) == 1
    after = run_terms(db, run)
    assert after.whatif.sweep([Rule()]).truth_px[0] < before.whatif.sweep([Rule()]).truth_px[0]


def test_regions_keep_what_each_outcome_would_give(db, run, tiny_split):
    refresh_terms(db, run)
    region = load_regions(db, run.id, tiny_split[0].id)[0]
    rows = db.read().execute("SELECT * FROM region_outcomes WHERE region_id = ?", [region.id])
    outcomes = {row["outcome"]: row for row in rows}
    assert set(outcomes) == {"adopt", "keep", "reject"}
    assert outcomes["reject"]["tp"] == outcomes["reject"]["fp"] == 0
    there = {row["tp"] + row["fn"] for row in outcomes.values()}
    assert len(there) == 1 and outcomes["adopt"]["tp"] > 0.8 * there.pop()


def test_the_pairs_that_change_sides_are_told(db, run, tiny_split):
    refresh_terms(db, run)
    terms = run_terms(db, run)
    changed = terms.whatif.changed_pairs(rule_of_run(run.settings), Rule(high=0.0))
    names = {tiny_split[int(place)].name for place in changed}
    assert names == {"0000", "0001"}  # the third pair has no change at all


def test_outcomes_in_memory_are_those_of_the_regions_that_are_there(db, tiny_split, run):
    unsaved = Unsaved(db)
    before = unsaved.of_run(run)
    db.write(
        lambda c: [
            c.execute("UPDATE regions SET id = id + 100 WHERE id = ?", [region])
            for region in sorted(before, reverse=True)
        ]
    )
    assert unsaved.of_run(run) == {region + 100: each for region, each in before.items()}
    refresh_terms(db, run)
    assert before and unsaved.of_run(run) == {}
