"""What `train` does once its options are read: fit a net, keep its row, say what comes next."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from reviewer.cli.options import progress_bar
from reviewer.cli.pipeline import run_stages
from reviewer.words import FoldKind, TrainedOn

if TYPE_CHECKING:
    from reviewer.store.database import Store
    from reviewer.synthesis.bank import Bank
    from reviewer.training.loop import Step
    from reviewer.training.recipes import Recipe
    from reviewer.training.session import TrainingData, Validated
    from reviewer.training.settings import TrainingSettings


@dataclass(frozen=True)
class Order:
    """What is to be trained, whatever on."""

    title: str
    recipe: Recipe
    splits: list[str]
    backbone: Path | None
    start: Path | None
    workers: int
    epochs: int | None

    def folder(self, store: Store) -> Path:
        return store.folder / "trainings" / self.title


@dataclass(frozen=True)
class Folding:
    """Which ground truth is divided, and how."""

    by: FoldKind
    parts: int
    warped_by: str | None
    states: tuple[str, ...]


def train_on_synthesis(
    store: Store,
    order: Order,
    train_on: TrainedOn,
    open_objects: Callable[[], Bank],
) -> None:
    from dataclasses import replace

    from reviewer.synthesis.shelf import Shelf
    from reviewer.training.recipes import iterations_of_epochs
    from reviewer.training.selection import data_record, select_references
    from reviewer.training.session import train as fit
    from reviewer.training.stream import SyntheticData

    recipe, folder = order.recipe, order.folder(store)
    settings, pasting = recipe.settings, recipe.synthesis
    references = select_references(store, order.splits, train_on)
    if order.epochs:
        number = iterations_of_epochs(order.epochs, len(references), settings.batch)
        settings = replace(settings, iterations=number, decay_over=None)
        recipe = replace(recipe, settings=settings)
        typer.echo(
            f"{order.epochs} epochs of {len(references)} reference images in batches of"
            f" {settings.batch}: {number} iterations"
        )
    bank = open_objects()
    record = {
        **data_record(references, bank, pasting),
        "splits": sorted(order.splits),
        "train_on": train_on,
    }
    data = SyntheticData(Shelf([image.path for image in references]), bank, pasting, record)
    with progress_bar(order.title) as bar:
        done = fit(
            folder,
            settings,
            data,
            backbone=order.backbone,
            start=order.start,
            recipe=recipe.record() if recipe.name != "default" else None,
            workers=order.workers,
            on_step=lambda step: bar(step.iteration, settings.iterations, _speed(step)),
            on_validation=lambda at: _keep(store, order.title, folder, settings, data, at),
        )
    typer.echo(
        f"{order.title}: {done.iteration} iterations; best F on synthetic validation"
        f" {done.best_f:.4f} at iteration {done.best_iteration}"
    )
    typer.echo(f"next: reviewer run --detector {settings.net}:{folder / recipe.weights}")


def train_on_truth(
    store: Store,
    order: Order,
    folding: Folding,
    open_objects: Callable[[], Bank],
    share: float,
) -> None:
    """Fit a net a fold, then run the pipeline on what each found in the pairs it has not seen."""
    from dataclasses import replace

    from reviewer.crossfit.fitting import Reports, fit_folds
    from reviewer.crossfit.folds import Pasting, fold_data, write_truth
    from reviewer.export.folds import make_folds
    from reviewer.export.selection import Selection, select_labelled
    from reviewer.export.skipped import leave_out_skipped
    from reviewer.pipeline.runner import prepare_run
    from reviewer.pipeline.settings import IMPORTED, PipelineSettings
    from reviewer.store.runs import list_runs, run_or_newest
    from reviewer.store.skips import skipped_line

    settings, folder = order.recipe.settings, order.folder(store)
    names = [run.name for run in list_runs(store)]
    others = [name for name in names if name != order.title]
    warper = run_or_newest(store, folding.warped_by or (others[-1] if others else None))
    known = PipelineSettings.of_record(warper.settings)
    models = {stage: own for stage, own in known.model_settings.items() if stage != "detect"}
    found = replace(known, detector=IMPORTED, threshold=settings.threshold, model_settings=models)
    if order.title in names:
        prepare_run(store, order.title, found)  # another run of that name is told now, not then
    wanted = Selection(splits=tuple(order.splits), states=folding.states)
    selection = leave_out_skipped(store, wanted)
    labelled, without = select_labelled(store, selection)
    folds = make_folds(store, [item.pair for item in labelled], folding.by, folding.parts)
    files = write_truth(store, labelled, folder / "truth", selection, warper)
    pasting = Pasting(open_objects(), order.recipe.synthesis, share) if share else None
    folded = fold_data(folds, files, {"by": folding.by, "warped_by": warper.name}, pasting)
    typer.echo(
        f"{len(labelled)} pairs with ground truth ({len(without)} without), warped by"
        f" {warper.name}; folds by {folding.by}: {', '.join(fold.name for fold in folds)}"
    )
    if selection.skipped:
        typer.echo(f"left out: {skipped_line(len(selection.skipped))}")
    for fold in folds:
        past = [{pair.reference.sha256 for pair in pairs} for pairs in (fold.train, fold.test)]
        if past[0] & past[1]:
            typer.echo(
                f"fold {fold.name}: {len(past[0] & past[1])} of its reference images are trained on"
                " as well, with other live images"
            )
    with progress_bar(order.title) as bar:
        maps = fit_folds(
            store,
            folder,
            settings,
            folded,
            warper,
            Reports(
                step=lambda each, step: bar(
                    folded.index(each) * settings.iterations + step.iteration,
                    len(folded) * settings.iterations,
                    f"fold {each.fold.name}, {_speed(step)}",
                ),
                validated=lambda each, at: _keep(
                    store,
                    f"{order.title}/{each.fold.name}",
                    folder / each.fold.name,
                    settings,
                    each.data,
                    at,
                ),
            ),
            backbone=order.backbone,
            start=order.start,
            workers=order.workers,
        )
    judged = [pair.id for fold in folds for pair in fold.test]
    run_stages(
        store, order.title, found, "all", order.splits, 2, folders={"detect": maps}, only=judged
    )
    typer.echo(f"next: reviewer evaluate --run {order.title}; reviewer evaluate --table-a")


def _speed(step: Step) -> str:
    return f"loss {step.loss:.4f}, {step.pairs_per_s:.1f} pairs/s"


def _keep(
    store: Store,
    name: str,
    folder: Path,
    settings: TrainingSettings,
    data: TrainingData,
    at: Validated,
) -> None:
    """Say where a training stands, and bring the store's row of it up to date."""
    from reviewer.dataset.files import hash_file
    from reviewer.metrics import f_score
    from reviewer.store.trainings import StoredTraining, save_training

    typer.echo(
        f"{name}, iteration {at.iteration}: F {f_score(at.counts):.4f} on {data.kind} validation,"
        f" best {at.best_f:.4f} at {at.best_iteration}"
    )
    best, parts = folder / "best.pt", data.parts()
    save_training(
        store,
        StoredTraining(
            name,
            settings.net,
            best.relative_to(store.folder).as_posix(),
            hash_file(best),
            {"training": settings.record(), **parts},
            parts["data"]["sha256"],
            settings.seed,
            at.iteration,
            at.best_f,
        ),
    )
