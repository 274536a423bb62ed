"""The pipeline, its proposals and its clicks on real photographs.

    python benchmarks/real.py --data FOLDER [--aligner dis --aligner homography]
        [--detector siamese-lite --segmenter object-net --click click-net] [--json]

FOLDER holds `real_frames` (two views a room, `pairs.txt`), `real_pairs` (fixed cameras, layout
`t0t1`) and `tiny_coco` (objects to put in). For each set (see `real_sets`) and aligner: F without
and with DoI with 95 % intervals over pairs, wrong pixels a pair, the share of pixels no reference
shows; for the first aligner also how many changed objects any proposal covers, and clicks by size.
With `--json` one object of the figures that sets are compared by. `--seed` draws other objects;
given several times, the figures are means over the seeds, and how far the seeds differ is told.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import cv2
import numpy as np
import torch
from clicks import Trial, run_trials
from objects import SIZES, objects_of
from real_sets import write_sets

from reviewer.dataset.importer import import_split
from reviewer.dataset.settings import ImportSettings
from reviewer.editing.proposals import list_proposals
from reviewer.evaluation.counting import refresh_counts
from reviewer.flows.running import RunOrder, run_stages
from reviewer.masks import decode_rle, intersection_over_union
from reviewer.metrics import Counts, f_score
from reviewer.models.interfaces import ClickSegmenter
from reviewer.models.registry import build_click_segmenter
from reviewer.pipeline.settings import PipelineSettings
from reviewer.pipeline.stored import stored_alignment
from reviewer.records import Pair, Run
from reviewer.store.database import Store
from reviewer.store.pairs import list_pairs
from reviewer.store.results import finished_pairs
from reviewer.store.runs import run_of_name
from reviewer.store.scores import pair_counts
from reviewer.store.truth import truth_of_pair
from reviewer.words import ProposalSource

LEAST_PX = 12
DRAWS = 2000
VOID = 170
SOURCES: tuple[ProposalSource, ...] = tuple(
    s for s in get_args(ProposalSource) if s not in ("candidate", "missed", "extra")
)


@dataclass(frozen=True, slots=True)
class Scores:
    """What an aligner gives on a set; `low` and `high` bound 95 % of the draws over pairs."""

    pairs: int
    without: float
    with_doi: float
    low: float
    high: float
    gain_low: float
    gain_high: float
    wrong_px: float
    unseen: float


def open_set(store: Store, folders: Sequence[Path], name: str) -> None:
    """Import the folders of a set; hand-made masks may hold levels that mean nothing."""
    settings = ImportSettings(layout="t0t1")
    if name == "people":
        settings = ImportSettings(layout="t0t1", changed=(255,), ignore=(VOID,))
    for folder in folders:
        import_split(store, folder.name, folder, settings, lambda *_: None)


def run_of(store: Store, aligner: str, members: dict[str, str]) -> Run:
    """Make a run with the defaults but for the aligner and the members given."""
    order = RunOrder(PipelineSettings(aligner=aligner, **members), f"real {aligner}")
    run_stages(store, order)
    refresh_counts(store)
    return run_of_name(store, f"real {aligner}")


def score_run(store: Store, run: Run) -> Scores:
    """Pool pixels inside a split, mean over splits; draw pairs anew inside each split."""
    done = finished_pairs(store, run.id, "integrate")
    pairs = [pair for pair in list_pairs(store) if pair.id in done]
    counted = {pair.id: pair_counts(store, run.id, pair.id) for pair in pairs}
    splits = [[p.id for p in pairs if p.split == name] for name in sorted({p.split for p in pairs})]

    def mean_f(method: str, chosen: Sequence[Sequence[int]]) -> float:
        return float(
            np.mean([f_score(sum((counted[i][method] for i in ids), Counts())) for ids in chosen])
        )

    rng = np.random.default_rng(0)
    drawn = []
    for _ in range(DRAWS):
        anew = [[ids[k] for k in rng.integers(len(ids), size=len(ids))] for ids in splits]
        drawn.append((mean_f("base", anew), mean_f("doi", anew)))
    base, doi = np.array(drawn).T
    wrong = [counted[p.id]["doi"].fp for p in pairs]
    unseen = [
        1 - float(decode_rle(stored_alignment(store, run, pair).valid).mean()) for pair in pairs
    ]
    low, high = np.percentile(doi, (2.5, 97.5))
    gain_low, gain_high = np.percentile(doi - base, (2.5, 97.5))
    return Scores(
        len(pairs), mean_f("base", splits), mean_f("doi", splits), float(low), float(high),
        float(gain_low), float(gain_high), float(np.mean(wrong)), float(np.mean(unseen)),
    )  # fmt: skip


def coverage(store: Store, run: Run) -> list[float]:
    """Return, for every changed object, the IoU of the proposal that covers it best."""
    best = []
    for pair in list_pairs(store):
        masks = [decode_rle(p.mask) for p in list_proposals(store, pair, run, SOURCES)]
        for thing in objects_of(_truth(store, pair), LEAST_PX):
            best.append(max((intersection_over_union(m, thing) for m in masks), default=0.0))
    return best


def _truth(store: Store, pair: Pair) -> np.ndarray:
    truth = truth_of_pair(store, pair.id)
    assert truth is not None, pair.title
    return decode_rle(truth.mask)


def figures_of(
    scores: dict[str, dict[str, Scores]], covered: list[float], trials: list[Trial], aligner: str
) -> dict[str, float]:
    """Return the figures that are compared between sets."""
    found: dict[str, float] = {}
    for name, by_aligner in scores.items():
        own = by_aligner[aligner]
        found[f"f_base_{name}"], found[f"f_doi_{name}"] = own.without, own.with_doi
        found[f"fp_px_{name}"], found[f"unseen_{name}"] = own.wrong_px, own.unseen
    gains = [found[f"f_doi_{name}"] - found[f"f_base_{name}"] for name in scores]
    found["doi_gain"] = float(np.mean(gains))
    found["covered_50"], found["covered_80"] = (
        float(np.mean(np.array(covered) >= least)) for least in (0.5, 0.8)
    )
    for start, key in (("empty", "empty"), ("detector", "from_detector")):
        own_trials = [t for t in trials if t.start == start]
        eighty, ninety = np.mean([t.clicks for t in own_trials], axis=0)
        found[f"noc80_{key}"], found[f"noc90_{key}"] = float(eighty), float(ninety)
        found[f"iou1_{key}"] = float(np.mean([t.first_iou for t in own_trials]))
    milliseconds = [1e3 * s for t in trials for s in t.seconds]
    for rank in (50, 95):
        found[f"click_ms_p{rank}"] = float(np.percentile(milliseconds, rank))
    return found


def show(scores: dict[str, dict[str, Scores]], trials: list[Trial]) -> None:
    """Print what was measured with one seed, as Markdown tables."""
    print("| set | aligner | pairs | F without | F with DoI [95 %] | gain [95 %] | wrong px |")
    print("|---|---|---|---|---|---|---|")
    for name, by_aligner in scores.items():
        for aligner, s in by_aligner.items():
            print(
                f"| {name} | {aligner} | {s.pairs} | {s.without:.3f} | {s.with_doi:.3f}"
                f" [{s.low:.3f}, {s.high:.3f}] | {s.with_doi - s.without:+.3f}"
                f" [{s.gain_low:+.3f}, {s.gain_high:+.3f}] | {s.wrong_px:.0f} |"
            )
    print("\n| size | objects | from | IoU@1 | NoC@80 | NoC@90 |\n|---|---|---|---|---|---|")
    for start in ("empty", "detector"):
        for size in (name for _, name in SIZES):
            own = [t for t in trials if t.start == start and t.size == size]
            if own:
                eighty, ninety = np.mean([t.clicks for t in own], axis=0)
                first = np.mean([t.first_iou for t in own])
                cells = f"{len(own)} | {start} | {first:.2f} | {eighty:.2f} | {ninety:.2f}"
                print(f"| {size} | {cells} |")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--aligner", action="append", help="the first one also gives the figures")
    parser.add_argument("--detector", help="in place of the default")
    parser.add_argument("--segmenter", help="in place of the default")
    parser.add_argument("--click", default="click-net", help="click segmenter")
    parser.add_argument("--seed", type=int, action="append", help="of the sets, default: 0")
    parser.add_argument("--json", action="store_true", help="one JSON object")
    given = parser.parse_args()
    aligners = given.aligner or ["dis"]
    cv2.setNumThreads(1)
    torch.set_num_threads(1)
    members = {name: value for name in ("detector", "segmenter") if (value := getattr(given, name))}
    segmenter = build_click_segmenter(given.click)
    by_seed = []
    for seed in given.seed or [0]:
        measured = measure(given.data, seed, aligners, members, segmenter)
        by_seed.append(figures_of(*measured, aligners[0]))
        if not given.json:
            print(f"\nseed {seed}\n")
            show(measured[0], measured[2])
    figures = {key: float(np.mean([each[key] for each in by_seed])) for key in by_seed[0]}
    if given.json:
        print(json.dumps(figures))
        return
    print("\n| figure | value | least and most of the seeds |\n|---|---|---|")
    for key, value in figures.items():
        own = [each[key] for each in by_seed]
        print(f"| `{key}` | {value:.4g} | {min(own):.4g}, {max(own):.4g} |")


def measure(
    data: Path, seed: int, aligners: Sequence[str], members: dict[str, str],
    segmenter: ClickSegmenter,
) -> tuple[dict[str, dict[str, Scores]], list[float], list[Trial]]:  # fmt: skip
    """Return scores by set and aligner, the best IoU of each object's proposals, and the clicks."""
    scores: dict[str, dict[str, Scores]] = {}
    covered: list[float] = []
    trials: list[Trial] = []
    with tempfile.TemporaryDirectory() as place:
        for name, folders in write_sets(data, Path(place), seed).items():
            db = Path(place) / f"{name}.db"
            with Store(db, create=True) as store:
                open_set(store, folders, name)
                # The newest run is what the clicks read.
                runs = {aligner: run_of(store, aligner, members) for aligner in reversed(aligners)}
                scores[name] = {aligner: score_run(store, runs[aligner]) for aligner in aligners}
                covered += coverage(store, runs[aligners[0]])
            trials += run_trials(segmenter, db, 1, LEAST_PX)
    return scores, covered, trials


if __name__ == "__main__":
    main()
