"""The audit's way: which regions wait for a verdict, and in what order."""

import pytest
from people import draw

from reviewer.doi import Region
from reviewer.editing.commit import MaskEdit
from reviewer.errors import InvalidInput
from reviewer.evaluation.outcomes import refresh_terms
from reviewer.masks import empty_rle
from reviewer.store.audit_queue import list_doubtful
from reviewer.store.audit_rows import audit_rows
from reviewer.store.audits import add_audit
from reviewer.store.reasons import list_reasons, set_reasons
from reviewer.store.regions import StoredIntegration, load_regions
from reviewer.store.results import StageResult, save_results
from reviewer.store.reviews import annotator_id
from reviewer.store.revisions import NewRevision, add_revision

EMPTY = empty_rle(120, 160)


def test_doubt_is_nearness_to_the_threshold_and_seen_regions_come_last(db, run, tiny_split):
    pair = tiny_split[0]
    # (f_b, shared pixels, DoI): what the order is made of.
    made = [(1, 0, 0.2), (0, 40, 0.0), (1, 0, 0.95), (0, 3, 0.0), (1, 0, 0.85)]
    regions = [
        Region((), (), shared, f_b, 0.1, doi, "keep", False, "no_object", None)
        for f_b, shared, doi in made
    ]
    save_results(
        db,
        run.id,
        pair.id,
        [StageResult("integrate", "made up", 0.0, StoredIntegration(tuple(regions), EMPTY, EMPTY))],
    )
    stored = {region.id: region.number for region in load_regions(db, run.id, pair.id)}
    order = [stored[r.id] for r in list_doubtful(db, run.id, 0.9, 10) if r.id in stored]
    assert order[:2] in ([2, 4], [4, 2]) and order[2:] == [0, 3, 1]
    first = next(iter(stored))
    add_audit(db, first, annotator_id(db, "Ada"), "agree", EMPTY)
    assert first not in {region.id for region in list_doubtful(db, run.id, 0.9, 10)}


def test_loss_is_what_flipping_a_decision_gains(db, run):
    # The truth of the second pair vanishes: what was right to adopt there is now best flipped.
    add_revision(db, NewRevision(2, EMPTY, parent=1, annotator_id=None, source="import"))
    refresh_terms(db, run)
    found = list_doubtful(db, run.id, 0.9, 50, order="loss")
    gains = [region.gain_px for region in found]
    known = [gain for gain in gains if gain is not None]
    assert gains == sorted(known, reverse=True) + [None] * (len(gains) - len(known))
    outcomes = {row.region_id: row for row in audit_rows(db, run.id)}
    for region in found:
        row = outcomes[region.id]
        other = row.outcomes.get("keep" if row.choice == "adopt" else "adopt")
        if other is not None:
            own = row.outcomes[row.choice]
            assert region.gain_px == own.fp + own.fn - other.fp - other.fn


def test_what_a_rule_rejects_could_have_been_kept(db, run):
    db.write(lambda c: c.execute("UPDATE regions SET choice = 'reject'"))
    refresh_terms(db, run)
    outcomes = {row.region_id: row.outcomes for row in audit_rows(db, run.id)}
    for region in list_doubtful(db, run.id, 0.9, 50, order="loss"):
        reject, keep = (outcomes[region.id][name] for name in ("reject", "keep"))
        assert region.gain_px == reject.fp + reject.fn - keep.fp - keep.fn


def test_disagreement_is_a_verdict_against_the_rule_then_a_drawn_mask_against_it(db, run):
    ada, bob = annotator_id(db, "Ada"), annotator_id(db, "Bob")
    queue = [region.id for region in list_doubtful(db, run.id, 0.9, 50)]
    by_pair = {}
    for region in list_doubtful(db, run.id, 0.9, 50):
        by_pair.setdefault(region.pair_id, []).append(region.id)
    # Nobody drew anything yet; Ada wipes the second pair's truth, so its regions oppose her.
    draw(db, 2, "Ada", MaskEdit(EMPTY, 1))
    refresh_terms(db, run)
    found = list_doubtful(db, run.id, 0.9, 50, order="disagreement")
    assert {region.id for region in found[: len(by_pair[2])]} == set(by_pair[2])
    # Second opinions: what somebody else judged, and one has not; opposed ones first.
    add_audit(db, queue[0], ada, "agree", EMPTY)
    add_audit(db, queue[-1], ada, "reject", EMPTY)
    second = list_doubtful(
        db, run.id, 0.9, 50, order="disagreement", opinion="second", annotator_id=bob
    )
    assert [(r.id, r.opposed) for r in second] == [(queue[-1], True), (queue[0], False)]
    own = list_doubtful(db, run.id, 0.9, 50, opinion="second", annotator_id=ada)
    assert own == []
    add_audit(db, queue[0], bob, "agree", EMPTY)
    left = list_doubtful(db, run.id, 0.9, 50, opinion="second", annotator_id=bob)
    assert [region.id for region in left] == [queue[-1]]


def test_reasons_are_a_list_that_people_edit_and_verdicts_keep_their_words(db, run, tiny_split):
    region = load_regions(db, run.id, tiny_split[0].id)[0].id
    reason = list_reasons(db)[0]
    add_audit(db, region, annotator_id(db, "Ada"), "keep", EMPTY, reason=reason, comment="glare")
    set_reasons(db, ["  too   dark ", "glass"])
    assert list_reasons(db) == ["too dark", "glass"]
    stored = load_regions(db, run.id, tiny_split[0].id)[0]
    assert (stored.verdict_reason, stored.comment) == (reason, "glare")


@pytest.mark.parametrize(
    ("reasons", "text"),
    [
        (["ok", "  "], "line 2: must have 1 to 80"),
        (["x" * 81], "line 1: must have 1 to 80"),
        (["a", "b", "a"], "line 3: 'a' is there twice"),
        ([str(k) for k in range(41)], "at most 40"),
    ],
)
def test_a_bad_list_of_reasons_is_refused_and_changes_nothing(db, reasons, text):
    before = list_reasons(db)
    with pytest.raises(InvalidInput, match=text):
        set_reasons(db, reasons)
    assert list_reasons(db) == before
