"""Run stages of the pipeline, on layers of one's own where there are any."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from reviewer.dataset.layers import import_layer
from reviewer.flows.listening import NOBODY, Listener
from reviewer.pipeline.fields import packing
from reviewer.pipeline.members import build_members
from reviewer.pipeline.runner import RunReport, prepare_run, run_pipeline, works_here
from reviewer.pipeline.settings import PipelineSettings
from reviewer.records import Run
from reviewer.store.database import Store
from reviewer.store.pairs import list_pairs, pair_ids
from reviewer.words import STAGES, EngineName, LayerKind, StageOrAll


@dataclass(frozen=True, slots=True)
class RunOrder:
    """What is to be run.

    Attributes:
        name: of the run; None names it after its members.
        splits: only these; () for all.
        only: ids of pairs, in place of splits.
        folders: by stage, the folder of flows, maps or masks that are brought in before.
        workers: pairs at a time.
        address: of a Ray cluster.
    """

    settings: PipelineSettings
    name: str | None = None
    stage: StageOrAll = "all"
    splits: Sequence[str] = ()
    only: Sequence[int] | None = None
    folders: Mapping[str, Path] = field(default_factory=dict)
    workers: int = 2
    engine: EngineName = "local"
    address: str | None = None


def run_stages(store: Store, order: RunOrder, listener: Listener = NOBODY) -> RunReport:
    """Open the run, bring in the layers of its folders, do its stages; what is done stays done.

    Pairs that fail are in the report; the others go on.

    Raises:
        Conflict: when a run of that name has other settings.
        InvalidInput: for a bad file of a folder, or a member that cannot be built.
    """
    built = build_members(order.settings)
    for remark in built.remarks():
        listener.say(remark)
    run = prepare_run(store, order.name, order.settings, built)
    # Elsewhere every worker builds its own; the memory is needed for those.
    members = built if works_here(order.engine, order.workers) else None
    del built
    for stage, folder in order.folders.items():
        _bring_in(store, run, stage, folder, order.splits, listener)
    with listener.progress(run.name) as advance:
        return run_pipeline(
            store,
            run,
            pair_ids(store, order.splits) if order.only is None else order.only,
            stages=[stage for stage in STAGES if order.stage in (stage, "all")],
            engine=order.engine,
            address=order.address,
            workers=order.workers,
            members=members,
            progress=lambda report: advance(
                report.done + report.already_done + len(report.failures),
                report.total,
                f"{order.stage}, {report.pairs_per_s:.1f} pairs/s",
            ),
        )


def _bring_in(
    store: Store, run: Run, stage: str, folder: Path, splits: Sequence[str], listener: Listener
) -> None:
    kinds: dict[str, list[tuple[LayerKind, Path]]] = {
        "align": [("alignment", folder)],
        "detect": [("detection", folder)],
        "search": [("live-objects", folder / "live"), ("reference-objects", folder / "reference")],
    }
    for kind, place in kinds[stage]:
        found = import_layer(store, run, kind, place, list_pairs(store, splits), packing(run))
        listener.say(f"{kind}: {found.imported} pairs from {place}")
