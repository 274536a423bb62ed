"""Train a detector: on synthetic pairs of reference images, or on ground truth, fold by fold."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from reviewer.crossfit.fitting import Reports, fit_folds
from reviewer.crossfit.folds import FoldData, Pasting, fold_data, write_truth
from reviewer.dataset.files import hash_file
from reviewer.export.folds import Fold, make_folds
from reviewer.export.selection import Selection, select_labelled
from reviewer.export.skipped import leave_out_skipped
from reviewer.extras import need
from reviewer.flows.listening import NOBODY, Listener
from reviewer.flows.running import RunOrder, run_stages
from reviewer.metrics import f_score
from reviewer.pipeline.runner import RunReport, prepare_run
from reviewer.pipeline.settings import IMPORTED, PipelineSettings
from reviewer.records import Run
from reviewer.reports.curve import draw_curve
from reviewer.store.database import Store
from reviewer.store.runs import list_runs, run_or_newest
from reviewer.store.skips import skipped_line
from reviewer.store.trainings import StoredTraining, save_training
from reviewer.synthesis.bank import Bank
from reviewer.synthesis.shelf import Shelf
from reviewer.training.loop import Step
from reviewer.training.recipes import Recipe, iterations_of_epochs
from reviewer.training.selection import data_record, select_references
from reviewer.training.session import TrainingData, Validated, train
from reviewer.training.settings import TrainingSettings
from reviewer.training.stream import SyntheticData
from reviewer.words import FoldKind, TrainedOn

OpenBank = Callable[[], Bank]
"""Opens the objects to paste; called only when some are pasted."""


@dataclass(frozen=True, slots=True)
class TrainingOrder:
    """What is to be trained, whatever on.

    Attributes:
        title: of the training, which is also the name of its folder below `trainings/`.
        splits: only these; () for all.
        backbone: ResNet-18 weights that the encoders start from.
        start: checkpoint of the same net to go on from.
        workers: processes that make pairs; 0 for none beside this one.
        epochs: how often all reference images are shown, in place of the recipe's iterations.
    """

    title: str
    recipe: Recipe
    splits: tuple[str, ...] = ()
    backbone: Path | None = None
    start: Path | None = None
    workers: int = 0
    epochs: int | None = None

    def folder(self, store: Store) -> Path:
        """Return where the training keeps its files."""
        return store.folder / "trainings" / self.title


@dataclass(frozen=True, slots=True)
class Folding:
    """Which ground truth is divided, and how.

    Attributes:
        parts: number of folds, for `same-split` only.
        warped_by: run whose alignments are used; None for the newest.
        states: only ground truth in these states; () for all that counts.
        share: of synthetic pairs among those shown, in [0, 1).
    """

    by: FoldKind = "workspace"
    parts: int = 5
    warped_by: str | None = None
    states: tuple[str, ...] = ()
    share: float = 0.5


def train_on_synthesis(
    store: Store,
    order: TrainingOrder,
    train_on: TrainedOn,
    open_bank: OpenBank,
    listener: Listener = NOBODY,
) -> Validated:
    """Fit a net to synthetic pairs of reference images; go on where its folder stands.

    Args:
        train_on: whose reference images, seen from the splits of the order.

    Raises:
        Conflict, InvalidInput, TrainingFailed: see `training.session.train`.
    """
    need("train", "matplotlib")  # its curve is drawn with every checkpoint
    recipe, folder = order.recipe, order.folder(store)
    settings, pasting = recipe.settings, recipe.synthesis
    references = select_references(store, order.splits, train_on)
    if order.epochs:
        number = iterations_of_epochs(order.epochs, len(references), settings.batch)
        settings = replace(settings, iterations=number, decay_over=None)
        recipe = replace(recipe, settings=settings)
        listener.say(
            f"{order.epochs} epochs of {len(references)} reference images in batches of"
            f" {settings.batch}: {number} iterations"
        )
    bank = open_bank()
    record = {
        **data_record(references, bank, pasting),
        "splits": sorted(order.splits),
        "train_on": train_on,
    }
    data = SyntheticData(Shelf([image.path for image in references]), bank, pasting, record)
    with listener.progress(order.title) as advance:
        return train(
            folder,
            settings,
            data,
            backbone=order.backbone,
            start=order.start,
            recipe=recipe.record() if recipe.name != "default" else None,
            workers=order.workers,
            on_step=lambda step: advance(step.iteration, settings.iterations, _speed(step)),
            on_checkpoint=draw_curve,
            on_validation=lambda at: _keep(
                store, order.title, folder, settings, data, at, listener
            ),
        )


def train_on_truth(
    store: Store,
    order: TrainingOrder,
    folding: Folding,
    open_bank: OpenBank,
    listener: Listener = NOBODY,
) -> RunReport:
    """Fit a net per fold, then run the pipeline on what each found in the pairs it has not seen.

    Raises:
        Conflict, InvalidInput, TrainingFailed: see `training.session.train`.
        NotFound: when no run has aligned the pairs.
    """
    need("train", "matplotlib")
    settings, folder = order.recipe.settings, order.folder(store)
    warper, found = _settings_of_run(store, order, folding)
    wanted = Selection(splits=order.splits, states=folding.states)
    selection = leave_out_skipped(store, wanted)
    labelled, without = select_labelled(store, selection)
    folds = make_folds(store, [item.pair for item in labelled], folding.by, folding.parts)
    files = write_truth(store, labelled, folder / "truth", selection, warper)
    pasting = None
    if folding.share:
        pasting = Pasting(open_bank(), order.recipe.synthesis, folding.share)
    folded = fold_data(folds, files, {"by": folding.by, "warped_by": warper.name}, pasting)
    listener.say(
        f"{len(labelled)} pairs with ground truth ({len(without)} without), warped by"
        f" {warper.name}; folds by {folding.by}: {', '.join(fold.name for fold in folds)}"
    )
    if selection.skipped:
        listener.say(f"left out: {skipped_line(len(selection.skipped))}")
    _say_what_is_shared(folds, listener)
    maps = _fit(store, order, settings, folded, warper, listener)
    judged = [pair.id for fold in folds for pair in fold.test]
    run = RunOrder(found, order.title, folders={"detect": maps}, only=judged, splits=order.splits)
    return run_stages(store, run, listener)


def _settings_of_run(
    store: Store, order: TrainingOrder, folding: Folding
) -> tuple[Run, PipelineSettings]:
    """Return the run that aligned the pairs, and the settings of the run that is to come."""
    names = [run.name for run in list_runs(store)]
    others = [name for name in names if name != order.title]
    warper = run_or_newest(store, folding.warped_by or (others[-1] if others else None))
    known = PipelineSettings.of_record(warper.settings)
    models = {stage: own for stage, own in known.model_settings.items() if stage != "detect"}
    threshold = order.recipe.settings.threshold
    found = replace(known, detector=IMPORTED, threshold=threshold, model_settings=models)
    if order.title in names:
        prepare_run(store, order.title, found)  # another run of that name is told now, not then
    return warper, found


def _say_what_is_shared(folds: list[Fold], listener: Listener) -> None:
    for fold in folds:
        past = [{pair.reference.sha256 for pair in pairs} for pairs in (fold.train, fold.test)]
        if past[0] & past[1]:
            listener.say(
                f"fold {fold.name}: {len(past[0] & past[1])} of its reference images are trained on"
                " as well, with other live images"
            )


def _fit(
    store: Store,
    order: TrainingOrder,
    settings: TrainingSettings,
    folded: list[FoldData],
    warper: Run,
    listener: Listener,
) -> Path:
    folder = order.folder(store)
    with listener.progress(order.title) as advance:
        return fit_folds(
            store,
            folder,
            settings,
            folded,
            warper,
            Reports(
                step=lambda each, step: advance(
                    folded.index(each) * settings.iterations + step.iteration,
                    len(folded) * settings.iterations,
                    f"fold {each.fold.name}, {_speed(step)}",
                ),
                checkpoint=draw_curve,
                validated=lambda each, at: _keep(
                    store,
                    f"{order.title}/{each.fold.name}",
                    folder / each.fold.name,
                    settings,
                    each.data,
                    at,
                    listener,
                ),
            ),
            backbone=order.backbone,
            start=order.start,
            workers=order.workers,
        )


def _speed(step: Step) -> str:
    return f"loss {step.loss:.4f}, {step.pairs_per_s:.1f} pairs/s"


def _keep(
    store: Store,
    name: str,
    folder: Path,
    settings: TrainingSettings,
    data: TrainingData,
    at: Validated,
    listener: Listener,
) -> None:
    """Say where a training stands, and bring the store's row of it up to date."""
    listener.say(
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
