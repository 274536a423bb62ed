"""Take many pairs through the stages: plan, distribute, write; resume a run that was killed.

This process plans every pair and is the only one that writes: what is there already is left alone,
what another run made of the same inputs is taken over, the rest goes to an engine. Each pair is
written in one transaction as soon as it is done, so a killed run loses the pairs in hand.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import count

from reviewer.errors import Conflict
from reviewer.models.registry import segmenter_reads
from reviewer.pipeline.engines import Engine
from reviewer.pipeline.members import Members, build_members
from reviewer.pipeline.plan import Plan
from reviewer.pipeline.settings import PipelineSettings, current_versions
from reviewer.pipeline.work import Known, PairTask
from reviewer.records import Pair, Run
from reviewer.store import layers, runs
from reviewer.store.database import Store
from reviewer.store.pairs import pairs_of_ids
from reviewer.store.results import save_results, stage_keys, take_over
from reviewer.words import STAGES, EngineName, Stage

CHUNK = 256


@dataclass(slots=True)
class RunReport:
    """What a run did so far: pairs finished, pairs that were done before, failures by pair."""

    run: str
    total: int
    done: int = 0
    already_done: int = 0
    taken_over: int = 0
    failures: list[str] = field(default_factory=list)
    started: float = field(default_factory=time.perf_counter)

    @property
    def pairs_per_s(self) -> float:
        """Pairs per second."""
        elapsed = time.perf_counter() - self.started
        return (self.done + len(self.failures)) / elapsed if elapsed > 0 else 0.0


Progress = Callable[[RunReport], None]


def prepare_run(
    store: Store, name: str | None, settings: PipelineSettings, members: Members | None = None
) -> Run:
    """Open the run of these settings, made if it is new.

    What is recorded are the settings in force: the members' defaults too, so that a later version
    with other defaults still knows what this run did. Without a name the run is called after its
    members, with a number where that name has other settings.

    Args:
        members: the models of these settings, where they are built already.

    Raises:
        Conflict: when a run of the given name has other settings.
        InvalidInput: when a member is unknown, or a new name cannot be read.
    """
    built = members or build_members(settings)
    threshold = built.threshold() if settings.threshold is None else settings.threshold
    settings = replace(settings, model_settings=built.settings(), threshold=threshold)
    if name is not None:
        if name not in {run.name for run in runs.list_runs(store)}:
            name = runs.clean_run_name(name)
        return _open(store, name, settings)
    for number in count(1):
        chosen = settings.default_name() + (f"-{number}" if number > 1 else "")
        with suppress(Conflict):
            return _open(store, chosen, settings)
    raise AssertionError("numbers do not end")


def _open(store: Store, name: str, settings: PipelineSettings) -> Run:
    """Open or make a run; one whose record lacks settings that came later is completed first."""
    names = {
        "aligner": settings.aligner,
        "detector": settings.detector,
        "segmenter": settings.segmenter,
    }
    wanted = settings.record()
    for run in runs.list_runs(store):
        if run.name == name and run.settings != wanted:
            known = PipelineSettings.of_record(run.settings)
            models = {
                stage: {**settings.model_settings.get(stage, {}), **own}
                for stage, own in known.model_settings.items()
            }
            if replace(known, model_settings=models).record() == wanted:
                _refuse_other_relu(name, known, settings)
                runs.complete_settings(store, run.id, wanted)
    return runs.open_run(store, name, names, wanted, current_versions())


def _refuse_other_relu(name: str, known: PipelineSettings, wanted: PipelineSettings) -> None:
    """Keep a run of an early version from getting results of both arithmetics of a TANet."""
    noted = "arithmetic" in known.model_settings.get("detect", {})
    arithmetic = wanted.model_settings.get("detect", {}).get("arithmetic") or {}
    if not noted and arithmetic.get("relu") == "block":
        raise Conflict(
            f"run {name}: began when {wanted.detector} was computed with one ReLU a stage, which"
            " was not the public net; give this one a name of its own with --name"
        )


def run_pipeline(
    store: Store,
    run: Run,
    pair_ids: Sequence[int],
    *,
    stages: Sequence[Stage] = STAGES,
    engine: EngineName = "local",
    address: str | None = None,
    workers: int = 1,
    members: Members | None = None,
    progress: Progress = lambda report: None,
) -> RunReport:
    """Do the missing stages of all pairs; a pair that fails is recorded, and the run continues.

    Args:
        engine: "local" or "ray", the latter at `address` (None: a cluster on this machine).
        workers: pairs at a time.
        members: the models of the run, where they are built already; else the engine builds them.
        progress: called after each pair.

    Raises:
        InvalidInput: when the engine or the models cannot be had.
    """
    settings = PipelineSettings.of_record(run.settings)
    report = RunReport(run.name, len(pair_ids))
    tasks = _tasks(store, run, settings, pair_ids, stages, report, progress)
    chosen = _engine(settings, engine, address, workers, members)
    for outcome in chosen.outcomes(tasks):
        failure = outcome.failure
        try:
            save_results(store, run.id, outcome.pair.id, outcome.results, failure)
        except Conflict as error:
            failure = "integrate", str(error)
            kept = [result for result in outcome.results if result.stage != "integrate"]
            save_results(store, run.id, outcome.pair.id, kept, failure)
        if failure is None:
            report.done += 1
        else:
            report.failures.append(f"pair {outcome.pair.title}, stage {failure[0]}: {failure[1]}")
        progress(report)
    return report


def works_here(engine: EngineName, workers: int) -> bool:
    """Say whether pairs are done in this process, with models that are built in it."""
    return engine == "local" and (workers == 1 or _has_gpu())


def _engine(
    settings: PipelineSettings,
    engine: EngineName,
    address: str | None,
    workers: int,
    members: Members | None,
) -> Engine:
    if engine == "ray":
        from reviewer.pipeline.engines.cluster import RayEngine

        return RayEngine(settings, workers, address)
    from reviewer.pipeline.engines.local import InProcess, Processes

    if works_here(engine, workers):
        return InProcess(settings, members or build_members(settings), workers)
    return Processes(settings, workers)


def _has_gpu() -> bool:
    from reviewer.models.device import best_device

    return best_device() != "cpu"


def _tasks(
    store: Store,
    run: Run,
    settings: PipelineSettings,
    pair_ids: Sequence[int],
    stages: Sequence[Stage],
    report: RunReport,
    progress: Progress,
) -> Iterator[PairTask]:
    """Yield what there is to do, pair by pair, with what earlier stages left."""
    plan = Plan(settings, segmenter_reads(settings.segmenter))
    wanted = [stage for stage in STAGES if stage in set(stages)]
    for start in range(0, len(pair_ids), CHUNK):
        ids = pair_ids[start : start + CHUNK]
        kept = stage_keys(store, run.id, ids)
        for pair in pairs_of_ids(store, ids):
            found = plan.of_pair(pair, kept[pair.id], wanted)
            todo = [(stage, found.keys[stage]) for stage in found.todo]
            left = [
                (stage, key)
                for stage, key in todo
                if not take_over(store, run.id, pair.id, stage, key)
            ]
            if left:
                yield PairTask(pair, tuple(left), _known(store, run, pair, plan, left))
                continue
            report.already_done += 1
            report.taken_over += bool(todo)
            progress(report)


def _known(
    store: Store, run: Run, pair: Pair, plan: Plan, todo: Sequence[tuple[Stage, str]]
) -> Known:
    """Load what the stages to do read of the ones that are done."""
    made = {stage for stage, _ in todo}
    read: set[Stage] = {read for stage in made for read in plan.inputs[stage]} - made
    # Imported objects are there before their stage says so.
    if "search" in made:
        read.add("search")
    known = Known()
    if "align" in read:
        known.alignment = layers.load_alignment(store, run.id, pair.id)
    if "detect" in read:
        known.detection = layers.load_detection(store, run.id, pair.id)
    if "label" in read:
        known.labels = layers.load_labels(store, run.id, pair.id)
    if "search" in read:
        known.objects = layers.load_objects(store, run.id, pair.id)
    return known
