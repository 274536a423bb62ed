"""What rejecting the regions that the reference shows too (`--seen reject`) does to F, by scope.

    python benchmarks/seen.py worlds/world-{11,23}-4/reviewer.db --pool

For the first run of each database: mean F over splits with `keep` (the paper) and with `reject`,
from stored integers, and the 95 % interval of the change over pairs, drawn anew inside each split.
`--pool` adds a line for all databases together, whose splits weigh alike.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from reviewer.evaluation.counting import refresh_counts
from reviewer.evaluation.outcomes import refresh_terms
from reviewer.evaluation.predictors import predict_errors
from reviewer.evaluation.protocols import Protocol, paired_change, protocol_lines
from reviewer.evaluation.rule_scores import rule_scores
from reviewer.evaluation.rules import Rule
from reviewer.evaluation.tables import MEAN
from reviewer.store.audit_rows import audit_rows
from reviewer.store.database import Store
from reviewer.store.runs import list_runs
from reviewer.store.scores import PairScore
from reviewer.words import Scope

SCOPES: tuple[Scope, ...] = ("component", "image")
APART = 1_000_000
"""Between the pair keys of two databases."""


def scores_of(db: Path) -> tuple[str, dict[Scope, tuple[list[PairScore], list[PairScore]]]]:
    """Return what is said of the seen regions, and (keep, reject) counts by scope."""
    with Store(db) as store:
        run = list_runs(store)[0]
        refresh_counts(store)
        refresh_terms(store, run)
        seen = predict_errors(audit_rows(store, run.id))[1]
        found = {}
        for scope in SCOPES:
            keep, reject = (
                rule_scores(store, run, Rule(scope=scope, seen=how)) for how in ("keep", "reject")
            )
            found[scope] = (keep, reject)
    return f"{seen.errors} of {seen.regions}", found


def mean_f(scores: list[PairScore]) -> float:
    """Pooled pixels inside a split, unweighted mean over splits."""
    (mean,) = (line for line in protocol_lines(scores, Protocol()) if line.split == MEAN)
    return mean.f_score


def row(
    name: str, seen: str, by_scope: dict[Scope, tuple[list[PairScore], list[PairScore]]]
) -> str:
    """Return a line of the table."""
    cells = [name, seen]
    for scope in SCOPES:
        keep, reject = by_scope[scope]
        change = paired_change(keep, reject)
        cells.append(f"{mean_f(keep):.4f} -> {mean_f(reject):.4f}")
        cells.append(f"{change.value:+.4f} [{change.low:+.4f}, {change.high:+.4f}]")
    return "| " + " | ".join(cells) + " |"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dbs", type=Path, nargs="+", help="databases with a run and ground truth")
    parser.add_argument("--pool", action="store_true", help="a line for all together")
    given = parser.parse_args()
    print("| world | wrong where f_b = 0 | component | change | image | change |")
    print("|---|---|---|---|---|---|")
    pooled: dict[Scope, tuple[list[PairScore], list[PairScore]]] = {s: ([], []) for s in SCOPES}
    for number, db in enumerate(given.dbs):
        name = db.resolve().parent.name
        seen, by_scope = scores_of(db)
        print(row(name, seen, by_scope))
        for scope, both in by_scope.items():
            for everyone, own in zip(pooled[scope], both, strict=True):
                everyone += [
                    replace(s, split=f"{name}/{s.split}", pair_id=number * APART + s.pair_id)
                    for s in own
                ]
    if given.pool:
        print(row("together", "", pooled))


if __name__ == "__main__":
    main()
