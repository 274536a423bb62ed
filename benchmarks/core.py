"""Measure the limits of the core: DoI, rendering, importing, the pipeline, evaluating, exporting.

Prints a table; `--json` prints one JSON object. One core unless a limit says otherwise: set
OMP_NUM_THREADS=1 and `taskset -c 0` for exact conditions. The 1875-pair set is made from one
rendered pair a split, repeated under other names; images and masks have their real size and noise.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from reviewer.dataset.importer import ImportSettings, import_split
from reviewer.dataset.layouts import find_splits
from reviewer.demo.world import PAPER_PAIRS, SplitPlan, render_split
from reviewer.doi import integrate
from reviewer.evaluation.counting import refresh_counts
from reviewer.evaluation.tables import table_lines
from reviewer.export.coco import export_coco
from reviewer.export.png import export_png
from reviewer.export.selection import Selection, select_labelled
from reviewer.pipeline.runner import prepare_run, run_pipeline
from reviewer.pipeline.settings import PipelineSettings
from reviewer.store.database import Store
from reviewer.store.pairs import pair_ids
from reviewer.store.queue import list_queue
from reviewer.store.regions import StoredIntegration
from reviewer.store.results import StageResult, save_results
from reviewer.store.reviews import annotator_id
from reviewer.store.revisions import newest_revisions
from reviewer.store.scores import split_scores

LIMITS = {
    "doi_ms_per_pair": 3.0,
    "render_s_per_pair": 1.2,
    "import_1875_s": 12.0,
    "pipeline_s_per_pair": 1.0,
    "evaluate_1875_s": 0.1,
    "export_png_coco_1875_s": 4.0,
    "queue_page_ms": 50.0,
}


def seconds(work: Callable[[], object], times: int = 1) -> float:
    """Return the shortest of several runs."""
    best = float("inf")
    for _ in range(times):
        start = time.perf_counter()
        work()
        best = min(best, time.perf_counter() - start)
    return best


def crowded_pair() -> tuple[np.ndarray, list[np.ndarray], list[np.ndarray]]:
    """M_o of a 640x480 pair, and its 20 live and 20 reference instances."""
    rng = np.random.default_rng(0)

    def blobs() -> list[np.ndarray]:
        masks = []
        for _ in range(20):
            mask = np.zeros((480, 640), np.uint8)
            centre = (int(rng.integers(40, 600)), int(rng.integers(40, 440)))
            axes = (int(rng.integers(6, 40)), int(rng.integers(6, 40)))
            cv2.ellipse(mask, centre, axes, float(rng.uniform(0, 180)), 0, 360, 1, -1)
            masks.append(mask.astype(bool))
        return masks

    live, past = blobs(), blobs()
    return np.logical_or.reduce([np.roll(mask, 4, axis=1) for mask in live[:15]]), live, past


def doi_ms() -> float:
    """DoI of a 640x480 pair with 20 live and 20 reference instances, both scopes; the slower."""
    change, live, past = crowded_pair()
    return 1000 * max(
        seconds(lambda scope=scope: integrate(change, live, past, scope=scope), 200)
        for scope in ("image", "component")
    )


def repeat_split(source: Path, target: Path, count: int) -> None:
    """Write a split of `count` pairs from the one pair of `source`, as links."""
    for name in ("reference", "live", "mask"):
        (target / name).mkdir(parents=True)
        (image,) = (source / name).glob("*.png")
        for k in range(count):
            os.link(image, target / name / f"{k:04d}.png")
    shutil.copy(source / "map.yaml", target)
    shutil.copy(source / "map.pgm", target)
    with (target / "poses.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["session", "name", "stamp", "x", "y", "theta"])
        for k in range(count):
            writer.writerow(["reference", f"{k:04d}", k, 2.0 * k, 0.0, 0.0])
            writer.writerow(["live", f"{k:04d}", 1000 + k, 2.0 * k + 0.02, 0.01, 0.01])


def import_all(store: Store, folder: Path) -> None:
    """Import every split of a folder."""
    for name, place in find_splits(folder, "sequence"):
        import_split(store, name, place, ImportSettings(), lambda *_: None)


def fill_run(store: Store) -> None:
    """Give every pair two predictions, without the pipeline."""
    run = prepare_run(store, "filled", PipelineSettings())
    for pair_id, revision in newest_revisions(store).items():
        made = StoredIntegration((), revision.mask, revision.mask)
        save_results(store, run.id, pair_id, [StageResult("integrate", "made up", 0.0, made)])


def measure(folder: Path) -> dict[str, float]:
    """Return all figures."""
    cv2.setNumThreads(1)
    figures = {"doi_ms_per_pair": doi_ms()}
    splits = ["cs1", "cr2", "lr3", "hw1"]
    start = time.perf_counter()
    for name in splits:
        render_split(folder / "world" / name, SplitPlan(name, 4, 11))
    figures["render_s_per_pair"] = (time.perf_counter() - start) / (4 * len(splits))
    with Store(folder / "world" / "reviewer.db", create=True) as store:
        import_all(store, folder / "world")
        pairs = pair_ids(store)
        run = prepare_run(store, None, PipelineSettings())
        took = seconds(lambda: run_pipeline(store, run, pairs))
        figures["pipeline_s_per_pair"] = took / len(pairs)
    for name, count in PAPER_PAIRS.items():
        one = folder / "one" / name
        render_split(one, SplitPlan(name, 1, 11))
        repeat_split(one, folder / "many" / name, count)
    with Store(folder / "many" / "reviewer.db", create=True) as store:
        figures["import_1875_s"] = seconds(lambda: import_all(store, folder / "many"))
        fill_run(store)
        refresh_counts(store)

        def evaluate() -> None:
            refresh_counts(store)
            table_lines(split_scores(store))

        def export() -> None:
            target = Path(tempfile.mkdtemp(dir=folder))
            labelled, _ = select_labelled(store, Selection())
            export_png(labelled, target / "png", Selection())
            export_coco(labelled, target / "coco.json")

        figures["evaluate_1875_s"] = seconds(evaluate, 5)
        figures["export_png_coco_1875_s"] = seconds(export, 2)
        person = annotator_id(store, "Ada")
        page = seconds(lambda: list_queue(store, person, run_id=1, order="doi", limit=50), 5)
        figures["queue_page_ms"] = 1000 * page
    return figures


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="one JSON object")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        figures = measure(Path(folder))
    if arguments.json:
        print(json.dumps(figures))
        return
    for name, limit in LIMITS.items():
        mark = "" if figures[name] <= limit else "  over the limit"
        print(f"{name:26} {figures[name]:9.3f}   limit {limit:g}{mark}")


if __name__ == "__main__":
    sys.exit(main())
