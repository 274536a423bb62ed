"""Number of clicks to an IoU of 0.8 and 0.9, for any click segmenter, by object size.

Protocol (Sofiiuk et al., RITM, 2022): the next click goes to the middle of the largest error, at
most 20 times, from an empty mask and from the detector's pixels around the object. Boundary F at 1,
2 and 3 px is of the mask after the last click. `--db` takes any database whose pairs have ground
truth and a run; without it, that of `reviewer demo --check`. `--objects` takes a CSV file with the
columns pair (such as cr1/0000), x and y: only objects that hold such a pixel are tried.
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
import time
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from objects import SIZES, around, load_pairs, objects_of, size_of

from reviewer.masks import Mask, depth, intersection_over_union
from reviewer.metrics import boundary_f
from reviewer.models.interfaces import Click, ClickSegmenter, Embedding, Prompt
from reviewer.models.registry import build_click_segmenter

MOST = 20
GOALS = (0.8, 0.9)
TOLERANCES = (1, 2, 3)
DEMO = Path(__file__).resolve().parent.parent / "demo-data/world-7-4/reviewer.db"


@dataclass(frozen=True, slots=True)
class Trial:
    """One object from one start: clicks to each goal, IoU after the first, boundary F, seconds."""

    size: str
    start: str
    clicks: tuple[int, ...]
    first_iou: float
    boundary: tuple[float, ...]
    seconds: tuple[float, ...]


def next_click(mask: Mask, truth: Mask) -> Click:
    """Return a click in the middle of the largest error."""
    best, place, positive = -1.0, (0, 0), True
    for error, belongs in ((truth & ~mask, True), (mask & ~truth, False)):
        count, labels, stats, _ = cv2.connectedComponentsWithStats(error.view(np.uint8))
        if count < 2:
            continue
        largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
        area = float(stats[largest, cv2.CC_STAT_AREA])
        if area > best:
            y, x = np.unravel_index(int(depth(labels == largest).argmax()), labels.shape)
            best, place, positive = area, (int(x), int(y)), belongs
    return Click(place[0] + 0.5, place[1] + 0.5, positive)


def try_object(
    segmenter: ClickSegmenter, embedding: Embedding, thing: Mask, mask: Mask, start: str
) -> Trial:
    """Click until the highest goal is met, or MOST times."""
    clicks: list[Click] = []
    ious, seconds = [intersection_over_union(mask, thing)], []
    while ious[-1] < GOALS[-1] and len(clicks) < MOST:
        clicks.append(next_click(mask, thing))
        begun = time.perf_counter()
        prompt = Prompt(tuple(clicks), None, mask if mask.any() else None)
        mask = segmenter.predict(embedding, prompt)[0].mask
        seconds.append(time.perf_counter() - begun)
        ious.append(intersection_over_union(mask, thing))
    needed = tuple(next((k for k, iou in enumerate(ious) if iou >= g), MOST) for g in GOALS)
    boundary = tuple(boundary_f(mask, thing, tolerance) for tolerance in TOLERANCES)
    size = size_of(int(np.count_nonzero(thing)))
    return Trial(size, start, needed, ious[min(1, len(ious) - 1)], boundary, tuple(seconds))


def run_trials(
    segmenter: ClickSegmenter, db: Path, every: int, least: int = 1,
    only: dict[str, list[tuple[int, int]]] | None = None,
) -> list[Trial]:  # fmt: skip
    """Try every object of at least so many pixels from both starts.

    Args:
        only: pixels (x, y) by the title of the pair; objects without one are left out.
    """
    trials = []
    for pair in load_pairs(db, every):
        if only is not None and pair.title not in only:
            continue
        embedding = segmenter.embed(pair.live, pair.warped, pair.confidence, pair.change)
        for thing in objects_of(pair.truth, least):
            if only is not None and not any(thing[y, x] for x, y in only[pair.title]):
                continue
            near = pair.detected & around(thing) & ~(pair.truth & ~thing)
            empty = np.zeros_like(thing)
            trials.append(try_object(segmenter, embedding, thing, empty, "empty"))
            trials.append(try_object(segmenter, embedding, thing, near, "detector"))
    return trials


def read_objects(path: Path) -> dict[str, list[tuple[int, int]]]:
    """Return the pixels of an object list by pair."""
    found: dict[str, list[tuple[int, int]]] = defaultdict(list)
    with path.open(newline="") as file:
        for row in csv.DictReader(file):
            found[row["pair"]].append((int(float(row["x"])), int(float(row["y"]))))
    return found


def main() -> None:
    """Measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--segmenter", default="click-net", help="click-net, grabcut, sam:PATH, sam2:PATH"
    )
    parser.add_argument("--db", type=Path, default=DEMO)
    parser.add_argument("--objects", type=Path, help="CSV: pair, x, y")
    parser.add_argument("--every", type=int, default=1, help="only each n-th pair")
    parser.add_argument("--json", action="store_true", help="one JSON object")
    arguments = parser.parse_args()
    # Random weights make denormals, which slow a processor five-fold.
    torch.set_flush_denormal(True)
    cv2.setNumThreads(1)
    torch.set_num_threads(1)
    segmenter = build_click_segmenter(arguments.segmenter)
    only = read_objects(arguments.objects) if arguments.objects else None
    trials = run_trials(segmenter, arguments.db, arguments.every, only=only)
    if not trials:
        sys.exit(f"{arguments.db}: no object to try; pairs need ground truth and a run's results")
    groups: dict[tuple[str, str], list[Trial]] = defaultdict(list)
    for trial in trials:
        groups[trial.start, trial.size].append(trial)
        groups[trial.start, "all"].append(trial)
    seconds = [s for trial in trials for s in trial.seconds]
    p50, p95 = (float(v) * 1e3 for v in np.percentile(seconds, (50, 95)))
    if arguments.json:
        mean = {
            start: np.mean([trial.clicks for trial in groups[start, "all"]], axis=0)
            for start in ("empty", "detector")
        }
        keys = (("empty", "empty"), ("from_detector", "detector"))
        result = {
            f"noc{int(goal * 100)}_{key}": float(mean[start][k])
            for key, start in keys
            for k, goal in enumerate(GOALS)
        }
        print(json.dumps({**result, "ms_per_click_p50": p50, "ms_per_click_p95": p95}))
        return
    print(f"{'start':10}{'size':8}{'n':>4}  NoC@80  NoC@90  >20 clicks   BF@1   BF@2   BF@3")
    for start in ("empty", "detector"):
        for size in (*(name for _, name in SIZES), "all"):
            group = groups[start, size]
            if not group:
                continue
            clicks = np.array([trial.clicks for trial in group])
            boundary = np.array([trial.boundary for trial in group]).mean(axis=0)
            failed = float(np.mean(clicks[:, 1] >= MOST))
            scores = "".join(f"{value:7.3f}" for value in boundary)
            print(
                f"{start:10}{size:8}{len(group):4}  {clicks[:, 0].mean():6.2f}"
                f"  {clicks[:, 1].mean():6.2f}  {failed:9.0%} {scores}"
            )
    print(f"{segmenter.model_id}: {p50:.0f} ms a click at the median, {p95:.0f} ms at the 95th")


if __name__ == "__main__":
    main()
