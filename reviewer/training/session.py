"""A training in its folder: checkpoints, the state to resume from, the log and its curve.

    best.pt    weights with the best F on the validation; what a run should use
    last.pt    the newest weights
    state.pt   what the training resumes from, written after the other two
    log.csv    loss of every iteration, scores of every validation
    curve.png  the same as a picture, where the caller draws it
    pairs.png  what the net is shown
    training.json   all settings and hashes; a folder keeps to one training

Every file is replaced whole, so a kill or a full disk leaves the checkpoint before.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import cv2
import numpy as np
import numpy.typing as npt
import torch
from torch import nn

from reviewer.atomic import whole_file
from reviewer.dataset.files import hash_file
from reviewer.errors import InvalidInput
from reviewer.metrics import Counts, f_score, precision, recall
from reviewer.models.device import best_device, choose_precision
from reviewer.models.nets.backbone import load_backbone
from reviewer.models.nets.build import build_net, full_settings, settings_of_record
from reviewer.models.nets.checkpoints import (
    load_checkpoint,
    save_checkpoint,
    save_whole,
)
from reviewer.models.nets.files import read_weights
from reviewer.models.nets.record import NetRecord
from reviewer.synthesis.folder import SHEET_PAIRS, contact_sheet
from reviewer.training.claiming import Identity, claim
from reviewer.training.log import Log
from reviewer.training.loop import Fit, Step, TrainingFailed
from reviewer.training.settings import TrainingSettings
from reviewer.training.stream import NumberedPairs

Image = npt.NDArray[np.uint8]


class TrainingData(Protocol):
    """What a net is trained on: `stream.SyntheticData`, or `labelled.LabelledData`.

    Attributes:
        kind: what the pairs are: "synthetic" or "labelled".
    """

    @property
    def kind(self) -> str: ...

    def parts(self) -> dict[str, dict[str, Any]]:
        """Return what identifies this training data, as plain JSON values; one part is "data"."""

    def streams(self, settings: TrainingSettings) -> tuple[NumberedPairs, NumberedPairs]:
        """Return pairs to train on and to validate on."""


@dataclass(frozen=True, slots=True)
class Validated:
    """Where a training stands after a validation."""

    iteration: int
    counts: Counts
    best_f: float
    best_iteration: int


def train(
    folder: Path,
    settings: TrainingSettings,
    data: TrainingData,
    *,
    backbone: Path | None = None,
    start: Path | None = None,
    recipe: Mapping[str, Any] | None = None,
    workers: int = 0,
    on_step: Callable[[Step], None] = lambda step: None,
    on_checkpoint: Callable[[Path], None] = lambda folder: None,
    on_validation: Callable[[Validated], None] = lambda validated: None,
) -> Validated:
    """Train to the end, resuming the folder's training.

    Args:
        backbone: ResNet-18 weights that the encoders start from.
        start: checkpoint of the same net that the whole of it starts from.
        recipe: what the record says of the recipe that the settings follow.
        on_checkpoint: called with the folder after each checkpoint and before its state is written.

    Raises:
        InvalidInput: when `start` is of another net or width.
        Conflict: when the folder holds a training with other settings.
        TrainingFailed: when the loss is not finite, or a checkpoint cannot be written (disk full);
            the folder keeps the last one.
    """
    settings = replace(settings, precision=choose_precision(settings.precision, best_device()))
    torch.manual_seed(settings.seed)
    net = build_net(settings.net, settings.width, **settings.net_settings)
    identity = {"training": settings.record(), **data.parts()}
    identity["data"]["backbone"] = hash_file(backbone) if backbone else "none"
    if start:
        identity["data"]["start"] = hash_file(start)
    if recipe:
        identity["recipe"] = dict(recipe)
    claim(folder, identity, complete=_complete, hint=_precision_hint)
    fit = Fit(net, settings)
    training, validation = data.streams(settings)
    best_f, best_iteration = -1.0, 0
    if (folder / "state.pt").exists():
        state = read_weights(folder / "state.pt")
        fit.go_on_from(state["fit"])
        best_f, best_iteration = state["best_f"], state["best_iteration"]
    else:
        if backbone:
            load_backbone(net, backbone)
        if start:
            _start_from(net, start, settings, data.kind)
        shown = [training.pair(number) for number in range(SHEET_PAIRS)]
        _write_png(folder / "pairs.png", contact_sheet(shown))
    log = Log(folder / "log.csv", fit.iteration)
    at = Validated(fit.iteration, Counts(), best_f, best_iteration)
    for step in fit.steps(training, until=settings.iterations, workers=workers):
        log.add(step)
        on_step(step)
        if step.iteration % settings.validate_every and step.iteration < settings.iterations:
            continue
        counts = fit.validate(validation)
        better = f_score(counts) > at.best_f
        at = Validated(
            step.iteration,
            counts,
            f_score(counts) if better else at.best_f,
            step.iteration if better else at.best_iteration,
        )
        try:
            _save(folder, fit, identity, at, log, data.kind, on_checkpoint, better=better)
        except OSError as error:
            raise TrainingFailed(
                f"iteration {step.iteration}: its checkpoint could not be written, {error};"
                f" {folder} keeps the one before"
            ) from error
        on_validation(at)
    return at


def _start_from(net: nn.Module, start: Path, settings: TrainingSettings, kind: str) -> None:
    trained, record = load_checkpoint(start, settings.net)
    if kind == "labelled" and "labelled_validation" in record.training:
        fold = record.training["data"].get("fold", "?")
        raise InvalidInput(
            f"{start}: was fitted to ground truth (fold {fold}), so pairs that it has seen would be"
            " tested; start from a checkpoint that was trained on synthetic pairs"
        )
    own = full_settings(record.net, record.settings)
    if record.width != settings.width or own != settings.net_settings:
        raise InvalidInput(
            f"{start}: is a {record.net} of width {record.width:g} {own or ''},"
            f" not of width {settings.width:g} {dict(settings.net_settings) or ''}"
        )
    if record.preprocessing != settings.preprocessing:
        raise InvalidInput(
            f"{start}: was trained with preprocessing {record.preprocessing},"
            f" not {settings.preprocessing}"
        )
    net.load_state_dict(trained.state_dict())


def _save(
    folder: Path,
    fit: Fit,
    identity: Identity,
    at: Validated,
    log: Log,
    kind: str,
    on_checkpoint: Callable[[Path], None],
    *,
    better: bool,
) -> None:
    """Write checkpoints and log; the state comes last, so it is never ahead of the rest."""
    counts = at.counts
    record = _record(fit, identity, at, kind)
    for name in ("best.pt", "last.pt") if better else ("last.pt",):
        save_checkpoint(folder / name, fit.net, record)
    log.validated(at.iteration, precision(counts), recall(counts), f_score(counts))
    log.flush()
    on_checkpoint(folder)
    best = {"best_f": at.best_f, "best_iteration": at.best_iteration}
    save_whole(folder / "state.pt", {"fit": fit.state(), **best})


def _precision_hint(known: Identity, wanted: Identity) -> str:
    began, here = known["training"]["precision"], wanted["training"]["precision"]
    if began == here:
        return ""
    return f" (it began in {began}, this would be {here}: --precision {began} goes on with it)"


def _complete(known: Identity, wanted: Identity) -> None:
    """Complete the record of an earlier version."""
    training = known["training"]
    defaults = TrainingSettings(training["net"]).record()
    training |= {key: value for key, value in defaults.items() if key not in training}
    recorded = settings_of_record(training["net"], training["net_settings"])
    training["net_settings"] = full_settings(training["net"], recorded)
    if training["precision"] == "auto":
        # which it was has not been noted
        training["precision"] = wanted["training"]["precision"]


def _record(fit: Fit, identity: Identity, at: Validated, kind: str) -> NetRecord:
    settings = fit.settings
    scores = {
        "precision": precision(at.counts),
        "recall": recall(at.counts),
        "f_score": f_score(at.counts),
    }
    return NetRecord(
        settings.net,
        settings.width,
        dict(settings.net_settings),
        preprocessing=settings.preprocessing,
        threshold=settings.threshold,
        window_px=settings.crop_px if fit.net.keeps_to_its_size else 0,
        training={**identity, "iteration": at.iteration, f"{kind}_validation": scores},
    )


def _write_png(path: Path, picture: Image) -> None:
    ok, data = cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
    assert ok, "OpenCV refused a plain picture"
    with whole_file(path) as file:
        file.write(data.tobytes())
