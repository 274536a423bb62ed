"""Take many pairs through the stages, resume where a killed run stopped, record what failed.

Threads suffice: the models are C code that lets go of the interpreter.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

from reviewer.errors import ReviewerError
from reviewer.models.registry import settings_of
from reviewer.pipeline.settings import PipelineSettings, current_versions
from reviewer.pipeline.stages import Members, build_members, run_stage
from reviewer.records import Pair, Run
from reviewer.store import runs
from reviewer.store.database import Store
from reviewer.store.runs import STAGES, Stage

Progress = Callable[[int, int], None]

PAPER_THRESHOLD = 0.5


@dataclass(slots=True)
class RunReport:
    """What a run did: pairs finished, skipped because they were done, and failures by pair."""

    run: str
    done: int = 0
    already_done: int = 0
    failures: list[str] = field(default_factory=list)


def prepare_run(store: Store, name: str | None, settings: PipelineSettings) -> Run:
    """Open the run of these settings, made if it is new.

    What is recorded are the settings in force: the members' defaults too, so that a later version
    with other defaults still knows what this run did.

    Raises:
        Conflict: when a run of that name has other settings.
        InvalidInput: when a member is unknown.
    """
    built = build_members(settings)
    in_force = {
        stage: settings_of(member)
        for stage, member in (
            ("align", built.aligner),
            ("detect", built.detector),
            ("search", built.segmenter),
        )
        if member is not None
    }
    threshold = settings.threshold
    if threshold is None:
        threshold = getattr(built.detector, "threshold", PAPER_THRESHOLD)
    settings = replace(settings, model_settings=in_force, threshold=threshold)
    members = {
        "aligner": settings.aligner,
        "detector": settings.detector,
        "segmenter": settings.segmenter,
    }
    chosen = name or settings.default_name()
    return runs.open_run(store, chosen, members, settings.record(), current_versions())


def run_pipeline(
    store: Store,
    run: Run,
    pairs: Sequence[Pair],
    *,
    stages: Iterable[Stage] = STAGES,
    workers: int = 1,
    progress: Progress = lambda done, total: None,
) -> RunReport:
    """Do the stages for all pairs that do not have them; a failing pair is recorded and passed by.

    Args:
        progress: called with (pairs finished, pairs in all) after each pair.
    """
    settings = PipelineSettings.of_record(run.settings)
    members = build_members(settings)
    wanted = [stage for stage in STAGES if stage in set(stages)]
    finished = {stage: runs.finished_pairs(store, run.id, stage) for stage in wanted}
    report = RunReport(run.name)
    todo = []
    for pair in pairs:
        missing = [stage for stage in wanted if pair.id not in finished[stage]]
        if missing:
            todo.append((pair, missing))
    report.already_done = len(pairs) - len(todo)

    def work(job: tuple[Pair, list[Stage]]) -> str | None:
        return _run_pair(store, run, settings, members, *job)

    with ThreadPoolExecutor(max_workers=workers) as pool:
        for number, failure in enumerate(pool.map(work, todo), start=1):
            if failure:
                report.failures.append(failure)
            else:
                report.done += 1
            progress(number, len(todo))
    return report


def _run_pair(
    store: Store,
    run: Run,
    settings: PipelineSettings,
    members: Members,
    pair: Pair,
    stages: Sequence[Stage],
) -> str | None:
    for stage in stages:
        try:
            run_stage(store, run, settings, members, stage, pair)
        except ReviewerError as error:
            message = f"pair {pair.title}, stage {stage}: {error}"
            runs.save_failure(store, run.id, pair.id, stage, str(error))
            return message
    return None
