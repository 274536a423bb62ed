"""A training in its folder: checkpoints, the state to go on from, the log and its curve.

    best.pt    weights with the best F on the synthetic validation; what a run should use
    last.pt    the newest weights
    state.pt   what the training goes on from, written after the other two
    log.csv    loss of every iteration, scores of every validation
    curve.png  the same as a picture
    pairs.png  what the net is shown
    training.json   all settings and hashes; a folder keeps to one training

Every file is replaced whole, so a kill or a full disk leaves the checkpoint before.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import torch

from reviewer.atomic import whole_file
from reviewer.dataset.files import hash_file
from reviewer.errors import Conflict
from reviewer.metrics import Counts, f_score, precision, recall
from reviewer.models.nets.backbone import load_backbone
from reviewer.models.nets.build import build_net
from reviewer.models.nets.checkpoints import NetRecord, read_weights, save_checkpoint, save_whole
from reviewer.synthesis.bank import Bank
from reviewer.synthesis.folder import SHEET_PAIRS, contact_sheet
from reviewer.synthesis.pairs import TRAINING, VALIDATION
from reviewer.synthesis.settings import SynthesisSettings
from reviewer.training.curve import draw_curve
from reviewer.training.log import Log
from reviewer.training.loop import Fit, Step
from reviewer.training.settings import TrainingSettings
from reviewer.training.stream import SyntheticPairs

Image = npt.NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class TrainingData:
    """What pairs are made of, and what the record says of it.

    Attributes:
        references: uint8 RGB images.
        bank: objects to paste.
        synthesis: how.
        record: plain JSON values: splits, hashes; part of what a folder keeps to.
    """

    references: Sequence[Image]
    bank: Bank
    synthesis: SynthesisSettings
    record: Mapping[str, Any]


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
    workers: int = 0,
    on_step: Callable[[Step], None] = lambda step: None,
    on_validation: Callable[[Validated], None] = lambda validated: None,
) -> Validated:
    """Train to the end, from where the folder's training stands.

    Raises:
        Conflict: when the folder holds a training with other settings.
        TrainingFailed: when the loss is not finite; the folder keeps the last checkpoint.
        OSError: when a checkpoint cannot be written; the one before stays.
    """
    torch.manual_seed(settings.seed)
    net = build_net(settings.net, settings.width, **settings.net_settings)
    identity = {
        "training": settings.record(),
        "synthesis": data.synthesis.record(),
        "data": {**data.record, "backbone": hash_file(backbone) if backbone else "none"},
    }
    _claim(folder, identity)
    fit = Fit(net, settings)
    held = data.bank.split(settings.held_out)
    training, validation = (
        SyntheticPairs(
            data.references,
            bank,
            data.synthesis,
            side=settings.crop_px,
            seed=settings.seed,
            stream=stream,
        )
        for bank, stream in zip(held, (TRAINING, VALIDATION), strict=True)
    )
    best_f, best_iteration = -1.0, 0
    if (folder / "state.pt").exists():
        state = read_weights(folder / "state.pt")
        fit.go_on_from(state["fit"])
        best_f, best_iteration = state["best_f"], state["best_iteration"]
    else:
        if backbone:
            load_backbone(net, backbone)
        shown = [training.pair(number) for number in range(SHEET_PAIRS)]
        _write_png(folder / "pairs.png", contact_sheet(shown))
    log = Log(folder / "log.csv", fit.iteration)
    at = Validated(fit.iteration, Counts(), best_f, best_iteration)
    while fit.iteration < settings.iterations:
        until = min(settings.iterations, fit.iteration + settings.validate_every)
        for step in fit.steps(training, until=until, workers=workers):
            log.add(step)
            on_step(step)
        counts = fit.validate(validation)
        f = f_score(counts)
        record = _record(settings, identity, fit.iteration, counts)
        if f > best_f:
            best_f, best_iteration = f, fit.iteration
            save_checkpoint(folder / "best.pt", net, record)
        save_checkpoint(folder / "last.pt", net, record)
        log.validated(fit.iteration, precision(counts), recall(counts), f)
        log.flush()
        save_whole(
            folder / "state.pt",
            {"fit": fit.state(), "best_f": best_f, "best_iteration": best_iteration},
        )
        draw_curve(folder / "log.csv", folder / "curve.png", f"{settings.net} x {settings.width:g}")
        at = Validated(fit.iteration, counts, best_f, best_iteration)
        on_validation(at)
    return at


def _claim(folder: Path, identity: dict[str, dict[str, Any]]) -> None:
    """Make the folder this training's own, or check that it is."""
    path = folder / "training.json"
    text = json.dumps(identity, indent=1, sort_keys=True)
    if not path.exists():
        with whole_file(path) as file:
            file.write(text.encode())
        return
    known, wanted = json.loads(path.read_text(encoding="utf-8")), json.loads(text)
    differing = [
        f"{part} {key}"
        for part in wanted
        for key in sorted({*wanted[part], *known.get(part, {})})
        if known.get(part, {}).get(key) != wanted[part].get(key)
    ]
    if differing:
        raise Conflict(
            f"{folder}: holds a training with another {', '.join(differing[:6])};"
            " give this one a name of its own with --name"
        )


def _record(
    settings: TrainingSettings, identity: dict[str, Any], iteration: int, counts: Counts
) -> NetRecord:
    scores = {
        "precision": precision(counts),
        "recall": recall(counts),
        "f_score": f_score(counts),
    }
    return NetRecord(
        settings.net,
        settings.width,
        dict(settings.net_settings),
        preprocessing=settings.preprocessing,
        training={**identity, "iteration": iteration, "synthetic_validation": scores},
    )


def _write_png(path: Path, picture: Image) -> None:
    ok, data = cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
    assert ok, "OpenCV refused a plain picture"
    with whole_file(path) as file:
        file.write(data.tobytes())
