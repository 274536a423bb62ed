"""Counts of pairs under another rule than the run's, as records like the stored ones.

So every protocol, table and interval that stands on stored counts stands on these as well.
"""

from __future__ import annotations

from reviewer.evaluation.outcomes import run_terms
from reviewer.evaluation.rules import Rule
from reviewer.records import Run
from reviewer.store.database import Store
from reviewer.store.pairs import list_pairs, list_splits
from reviewer.store.scores import PairScore


def rule_scores(store: Store, run: Run, rule: Rule) -> list[PairScore]:
    """Return the counts with DoI under `rule` of every pair whose terms are up to date.

    `outcomes.refresh_terms` first. True negatives and ignored pixels are no part of terms: 0.
    """
    terms = run_terms(store, run)
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
            counts,
        )
        for pair_id, counts in zip(terms.pair_ids, terms.whatif.counts_by_pair(rule), strict=True)
    ]
