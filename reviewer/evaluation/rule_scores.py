"""Counts of pairs under another rule than the run's, as records like the stored ones.

So every protocol, table and interval that stands on stored counts stands on these as well.
"""

from __future__ import annotations

from dataclasses import replace

from reviewer.evaluation.outcomes import run_terms
from reviewer.evaluation.rules import Rule
from reviewer.metrics import Counts
from reviewer.records import Run
from reviewer.store.database import Store
from reviewer.store.pairs import list_pairs, list_splits
from reviewer.store.scores import PairScore, pair_scores


def rule_scores(store: Store, run: Run, rule: Rule) -> list[PairScore]:
    """Return the counts with DoI under `rule` of every pair whose terms and counts are up to date.

    `outcomes.refresh_terms` and `counting.refresh_counts` first. Terms hold what is found; which
    pixels are scored at all, and which were not seen, is the same under every rule, and the
    detector's counts tell it.
    """
    terms = run_terms(store, run)
    detector = {s.pair_id: s.counts for s in pair_scores(store, run.name) if s.method == "base"}
    splits = {split.name: split for split in list_splits(store)}
    split_of = {pair.id: splits[pair.split] for pair in list_pairs(store)}
    return [
        PairScore(
            run.name,
            "doi",
            split_of[pair_id].name,
            split_of[pair_id].workspace,
            split_of[pair_id].object_group,
            pair_id,
            _whole(counts, detector[pair_id]),
        )
        for pair_id, counts in zip(terms.pair_ids, terms.whatif.counts_by_pair(rule), strict=True)
        if pair_id in detector
    ]


def _whole(found: Counts, detector: Counts) -> Counts:
    """Return counts of TP, FP and FN with what else is known of the pair's pixels."""
    scored = detector.tp + detector.fp + detector.fn + detector.tn
    return replace(
        detector,
        tp=found.tp,
        fp=found.fp,
        fn=found.fn,
        tn=scored - found.tp - found.fp - found.fn,
    )
