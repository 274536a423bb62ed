"""How fast pairs go through the pipeline: by stage, by engine, and with how much memory.

Engines are timed from their first outcome on, so that starting processes or a cluster does not
count. `integrate_pairs_per_s_core` is the stage `integrate` alone, from stored run-lengths to
stored regions, at 20 live and 20 reference objects. `--memory` takes 10,000 small pairs through the
whole pipeline, which takes minutes.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from core import crowded_pair, import_all, repeat_split, seconds

from reviewer.demo.world import SplitPlan, render_split
from reviewer.masks import encode_rle
from reviewer.models.interfaces import Alignment, Image
from reviewer.models.labellers.plain import NoLabeller
from reviewer.pipeline.members import Members, build_members
from reviewer.pipeline.plan import STAGE_VERSIONS
from reviewer.pipeline.runner import RunReport, prepare_run, run_pipeline
from reviewer.pipeline.settings import PipelineSettings
from reviewer.pipeline.work import Known, PairTask, PairWorker
from reviewer.records import ObjectInstance
from reviewer.store.database import Store
from reviewer.store.layers import StoredAlignment, StoredDetection
from reviewer.store.pairs import list_pairs, pair_ids
from reviewer.store.runs import run_summary
from reviewer.words import STAGES

LEAST_INTEGRATE = 300.0
SPLITS = ("cs1", "cr2", "lr3", "hw1")
ENGINES = {
    "local, 1 worker": {"workers": 1},
    "local, 2 workers": {"workers": 2},
    "ray, 2 workers": {"engine": "ray", "workers": 2},
}


def integrate_rate() -> float:
    """Pairs a second through `integrate` on one core, 20 + 20 objects, run-lengths in and out."""
    change, live, past = crowded_pair()
    everywhere = encode_rle(change | True)
    objects = [
        ObjectInstance(side, number, "", 1.0, encode_rle(mask))
        for side, masks in (("live", live), ("reference", past))
        for number, mask in enumerate(masks)
    ]
    known = Known(
        StoredAlignment(b"", 4, everywhere, 0.0, 0.0),
        StoredDetection(None, 0.5, encode_rle(change)),
        (),
        objects,
    )
    worker = PairWorker(PipelineSettings(threshold=0.5), Members(None, None, NoLabeller(), None))
    task = PairTask(None, (("integrate", "key"),), known)

    def once() -> None:
        assert worker.do(task).failure is None

    return 1 / seconds(once, 300)


def engine_rate(store: Store, number: int, options: dict) -> tuple[float, dict[str, float]]:
    """Pairs a second of an engine from its first outcome on, and by stage in one core's time."""
    # Another setting that changes nothing, so that nothing is taken over from the run before.
    own = {"align": {"disagreement_px": 1.5 + number * 1e-6}}
    run = prepare_run(store, f"engine {number}", PipelineSettings(model_settings=own))
    moments: list[float] = []
    ids = pair_ids(store)
    report = run_pipeline(
        store, run, ids, progress=lambda report: moments.append(time.perf_counter()), **options
    )
    assert report.done == len(ids), report.failures
    stages = {s.stage: 1 / max(s.mean_seconds, 1e-6) for s in run_summary(store, run.id)}
    skipped = int(options["workers"])
    return (len(moments) - skipped) / (moments[-1] - moments[skipped - 1]), stages


def resident_mib() -> float:
    """Memory of this process that is in use."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def memory_growth(folder: Path, count: int = 10_000) -> dict[str, float]:
    """Take small pairs through all stages; MiB in use after a tenth of them, and growth after."""
    one = folder / "one"
    render_split(one, SplitPlan("cs1", 1, 11))
    for image in one.rglob("*.png"):
        small = cv2.resize(cv2.imread(str(image)), (160, 120), interpolation=cv2.INTER_NEAREST)
        cv2.imwrite(str(image), small)
    repeat_split(one, folder / "many" / "cs1", count)
    seen: list[float] = []
    with Store(folder / "many" / "reviewer.db", create=True) as store:
        import_all(store, folder / "many")
        settings = PipelineSettings(aligner="homography")
        members = build_members(settings)
        still = replace(members, aligner=Still())
        run = prepare_run(store, "many", settings, members)

        def note(report: RunReport) -> None:
            if report.done in (count // 10, count):
                seen.append(resident_mib())

        start = time.perf_counter()
        report = run_pipeline(store, run, pair_ids(store), members=still, progress=note)
        took = time.perf_counter() - start
        assert report.done == count, report.failures[:3]
    return {
        "memory_pairs": float(count),
        "memory_mib_after_a_tenth": seen[0],
        "memory_growth_mib": seen[1] - seen[0],
        "memory_run_s": took,
    }


class Still:
    """An aligner for pictures that are too small for features: nothing has moved."""

    def align(self, reference: Image, live: Image) -> Alignment:
        """Return no motion."""
        shape = live.shape[:2]
        return Alignment(np.zeros((*shape, 2), np.float32), np.ones(shape, bool))


def measure(folder: Path, *, memory: bool) -> dict:
    """Return all figures."""
    cv2.setNumThreads(1)
    figures: dict = {"integrate_pairs_per_s_core": integrate_rate()}
    for name in SPLITS:
        render_split(folder / "world" / name, SplitPlan(name, 10, 11))
    with Store(folder / "world" / "reviewer.db", create=True) as store:
        import_all(store, folder / "world")
        assert len(list_pairs(store)) == 40 and set(STAGE_VERSIONS) == set(STAGES)
        rates: dict[str, float] = {}
        for number, (name, options) in enumerate(ENGINES.items()):
            rates[name], stages = engine_rate(store, number, options)
            if number == 0:
                rates = {**stages, **rates}
        figures["pairs_per_s"] = rates
    if memory:
        shutil.rmtree(folder / "world")
        figures |= memory_growth(folder)
    return figures


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="one JSON object")
    parser.add_argument("--memory", action="store_true", help="10,000 pairs, for memory")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        figures = measure(Path(folder), memory=given.memory)
    if given.json:
        print(json.dumps(figures))
        return 0
    for name, rate in figures.pop("pairs_per_s").items():
        print(f"{name:28} {rate:9.1f} pairs/s")
    for name, value in figures.items():
        print(f"{name:28} {value:9.1f}")
    if figures["integrate_pairs_per_s_core"] < LEAST_INTEGRATE:
        print(f"integrate_pairs_per_s_core: below {LEAST_INTEGRATE:g}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
