"""Fit one net per fold, and let each judge the pairs that it was not trained on.

trainings/NAME/truth/    the exported pairs (`t0t1`)
trainings/NAME/FOLD/     the training of a fold, as `training.session` has it
trainings/NAME/maps/     probability of change of every pair, by the net of its fold
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from reviewer.atomic import whole_file
from reviewer.crossfit.folds import FoldData
from reviewer.dataset.pictures import read_picture
from reviewer.models.detectors.net import NetDetector
from reviewer.models.interfaces import find_change
from reviewer.pipeline.fields import probability_png
from reviewer.pipeline.stored import warped_view
from reviewer.records import Run
from reviewer.store.database import Store
from reviewer.training.loop import Step
from reviewer.training.session import Validated, train
from reviewer.training.settings import TrainingSettings


@dataclass(frozen=True, slots=True)
class Reports:
    """Receives the steps, checkpoints (their folder) and validations of each fold."""

    step: Callable[[FoldData, Step], None]
    checkpoint: Callable[[Path], None]
    validated: Callable[[FoldData, Validated], None]


def fit_folds(
    store: Store,
    folder: Path,
    settings: TrainingSettings,
    folds: Sequence[FoldData],
    warper: Run,
    reports: Reports,
    *,
    backbone: Path | None = None,
    start: Path | None = None,
    workers: int = 0,
) -> Path:
    """Train all folds, resuming where they stopped, and write the maps; return their folder.

    Args:
        warper: run whose alignments the pairs are shown by, in training and in judging.

    Raises:
        Conflict, InvalidInput, TrainingFailed: see `training.session.train`.
    """
    for each in folds:
        place = folder / each.fold.name
        train(
            place,
            settings,
            each.data,
            backbone=backbone,
            start=start,
            workers=workers,
            on_step=lambda step, each=each: reports.step(each, step),  # type: ignore[misc]
            on_checkpoint=reports.checkpoint,
            on_validation=lambda at, each=each: reports.validated(each, at),  # type: ignore[misc]
        )
        if each.shelf is not None:
            each.shelf.clear()
        _judge(store, folder / "maps", settings.net, place / "best.pt", each, warper)
    return folder / "maps"


def _judge(
    store: Store,
    maps: Path,
    net: str,
    checkpoint: Path,
    each: FoldData,
    warper: Run,
) -> None:
    """Write the probability maps of a fold's test pairs, 8-bit PNG."""
    detector = NetDetector(net, str(checkpoint))
    for pair in each.fold.test:
        warped, valid, confidence = warped_view(store, warper, pair)
        live = read_picture(pair.live)
        probability = find_change(detector, warped, live, valid, confidence)
        with whole_file(maps / pair.split / f"{pair.name}.png") as file:
            file.write(probability_png(probability))
