"""The pipeline without weights on the demo world: every aligner, end to end.

For each aligner: what it leaves over (median over pairs of the mean absolute grey difference,
before and after), its forward-backward error, pairs that failed or look badly aligned, F without
and with DoI over the pairs that all aligners can do, and how many changed objects `oversegment`
finds at IoU >= 0.5 (components of the ground truth of at least 20 px). Needs a demo database
(`reviewer demo --check`); makes a run for each aligner there.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from statistics import median

from objects import objects_of

from reviewer.evaluation.counting import refresh_counts
from reviewer.flows.running import RunOrder, run_stages
from reviewer.masks import decode_rle, intersection_over_union
from reviewer.metrics import Counts, f_score
from reviewer.pipeline.settings import PipelineSettings
from reviewer.records import Pair, Run
from reviewer.store.database import Store
from reviewer.store.layers import load_alignment, load_objects
from reviewer.store.pairs import list_pairs
from reviewer.store.results import finished_pairs
from reviewer.store.revisions import newest_revision
from reviewer.store.runs import run_of_name
from reviewer.store.scores import pair_counts

DEMO = Path(__file__).resolve().parent.parent / "demo-data/world-7-4/reviewer.db"
ALIGNERS = ("homography", "ecc", "dis")
LEAST_PX = 20
LEAST_IOU = 0.5


def make_runs(store: Store) -> dict[str, Run]:
    """Do what is not done yet."""
    runs = {}
    for aligner in ALIGNERS:
        name = f"weight-free {aligner}"
        run_stages(store, RunOrder(PipelineSettings(aligner=aligner), name))
        runs[aligner] = run_of_name(store, name)
    refresh_counts(store)
    return runs


def mean_f(store: Store, run: Run, pairs: list[Pair], method: str) -> float:
    """Pooled pixels inside a split, unweighted mean over splits."""
    pooled: dict[str, Counts] = {}
    for pair in pairs:
        counts = pair_counts(store, run.id, pair.id)[method]
        pooled[pair.split] = pooled.get(pair.split, Counts()) + counts
    return sum(f_score(counts) for counts in pooled.values()) / len(pooled)


def object_recall(store: Store, run: Run, pairs: list[Pair]) -> float:
    """Share of the changed objects for which there is an object of IoU >= 0.5."""
    found = total = 0
    for pair in pairs:
        revision = newest_revision(store, pair.id)
        if revision is None:
            continue
        objects = load_objects(store, run.id, pair.id)
        masks = [decode_rle(thing.mask) for thing in objects if thing.side == "live"]
        for truth in objects_of(decode_rle(revision.mask), LEAST_PX):
            total += 1
            found += any(intersection_over_union(mask, truth) >= LEAST_IOU for mask in masks)
    return found / total


def measure(db: Path) -> dict[str, dict[str, float]]:
    """Return the figures of each aligner."""
    figures = {}
    with Store(db) as store:
        runs = make_runs(store)
        done = set.intersection(
            *(finished_pairs(store, run.id, "integrate") for run in runs.values())
        )
        everyone = list_pairs(store)
        pairs = [pair for pair in everyone if pair.id in done]
        for aligner, run in runs.items():
            aligned = [load_alignment(store, run.id, pair.id) for pair in everyone]
            there = [alignment for alignment in aligned if alignment is not None]
            own = [p for p in everyone if p.id in finished_pairs(store, run.id, "integrate")]
            figures[aligner] = {
                "pairs": len(own),
                "residual_before": median(a.residual_before for a in there),
                "residual_after": median(a.residual_after for a in there),
                "backward_px": median(a.backward_px for a in there if a.backward_px is not None),
                "doubted": sum(bool(a.doubt) for a in there),
                "f_without_doi": mean_f(store, run, own, "base"),
                "f_with_doi": mean_f(store, run, own, "doi"),
                "common_f_without_doi": mean_f(store, run, pairs, "base"),
                "common_f_with_doi": mean_f(store, run, pairs, "doi"),
                "object_recall": object_recall(store, run, own),
            }
    return figures


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--db", type=Path, default=DEMO)
    parser.add_argument("--json", action="store_true", help="one JSON object")
    given = parser.parse_args()
    figures = measure(given.db)
    if given.json:
        print(json.dumps(figures))
        return
    columns = list(next(iter(figures.values())))
    print("| aligner | " + " | ".join(columns) + " |")
    print("|---" * (len(columns) + 1) + "|")
    for aligner, values in figures.items():
        print(f"| {aligner} | " + " | ".join(f"{values[c]:.4g}" for c in columns) + " |")


if __name__ == "__main__":
    main()
