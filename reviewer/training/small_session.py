"""A training of a small net in its folder: `clicks` and `change`.

    click-net.safetensors, siamese-lite.safetensors   averaged weights; what a run should use
    state.pt        what the training resumes from, written after the weights
    training.json   all settings and hashes; a folder keeps to one training

Both are replaced whole every `SAVE_EVERY` steps, so a kill loses little. The numbers of the recipe
are the defaults of `ClickTraining`, `ChangeTraining` and `VIEWS_PX`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from torch import nn

from reviewer.dataset.files import hash_file
from reviewer.errors import InvalidInput
from reviewer.models.detectors.siamese import SiameseLiteDetector
from reviewer.models.nets.checkpoints import save_whole
from reviewer.models.nets.click_net import ClickNet
from reviewer.models.nets.files import bare_state, read_weights
from reviewer.models.nets.siamese_lite import SiameseLite
from reviewer.models.nets.small import load_small, save_small, small_weights
from reviewer.synthesis.bank import Bank
from reviewer.synthesis.rendered import load_rendered, piece_of
from reviewer.synthesis.views import ViewSettings
from reviewer.training.aligned_views import AlignedViews, align_views, aligned_views
from reviewer.training.change_loop import ChangeTraining, train_change_net
from reviewer.training.claiming import Identity, claim
from reviewer.training.click_loop import ClickTraining, train_click_net
from reviewer.training.loop import TrainingFailed
from reviewer.training.small_fit import SmallFit
from reviewer.words import SmallNet

SmallSettings = ClickTraining | ChangeTraining
SETTINGS: dict[SmallNet, type[ClickTraining] | type[ChangeTraining]] = {
    "clicks": ClickTraining,
    "change": ChangeTraining,
}
WEIGHTS: dict[SmallNet, str] = {"clicks": "click-net", "change": "siamese-lite"}
"""Under what name the weights of each are known, in their file and to the registry."""
VIEWS_PX: dict[SmallNet, int] = {"clicks": 320, "change": 256}
ROOMS = 0.5
"""Share of the views that are pieces of rendered rooms, where there are any."""
SAVE_EVERY = 250
LEAST_STEPS = 20
"""A tenth of the steps raise the rate."""


@dataclass(frozen=True, slots=True)
class SmallData:
    """What a small net is shown: backgrounds, things to stand before them, and how they are seen.

    Attributes:
        backgrounds: uint8 RGB pictures of any size. background_hashes: SHA-256 of their files.
        rooms: files of rendered views, which `ROOMS` of the views are pieces of, if there are any.
    """

    backgrounds: Sequence[npt.NDArray[np.uint8]]
    background_hashes: Sequence[str]
    bank: Bank
    views: ViewSettings
    rooms: Sequence[Path] = ()

    def make(self, rng: np.random.Generator) -> AlignedViews:
        """Make two views and align them."""
        if self.rooms and rng.random() < ROOMS:
            rendered = load_rendered(self.rooms[int(rng.integers(len(self.rooms)))])
            return align_views(piece_of(rendered, self.views, rng), rng)
        return aligned_views(self.backgrounds, self.bank, self.views, rng)

    def record(self) -> dict[str, Any]:
        """Return what identifies it, plain JSON values; `sha256` stands for all of it."""
        things = hashlib.sha256()
        for cutout in self.bank.objects:
            things.update(f"{cutout.alpha.shape}".encode())
            things.update(cutout.pixels.tobytes())
            things.update(cutout.alpha.tobytes())
        parts = [
            things.hexdigest(), list(self.background_hashes), asdict(self.views),
            [hash_file(path) for path in self.rooms],
        ]  # fmt: skip
        return {
            "sha256": hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest(),
            "backgrounds": len(self.backgrounds),
            "objects": len(self.bank.objects),
            "rooms": len(self.rooms),
            "side_px": self.views.side,
        }


def train_small(
    folder: Path,
    net: SmallNet,
    settings: SmallSettings,
    data: SmallData,
    *,
    start: Path | None = None,
    backbone: Path | None = None,
    beside: Path | None = None,
    on_step: Callable[[int, Mapping[str, float]], None] = lambda step, losses: None,
    on_saved: Callable[[int, Path], None] = lambda step, path: None,
) -> Path:
    """Train to the end, resuming the folder's training; return the file of the weights.

    Args:
        start: weights of the same net to start from.
        backbone: EfficientNet-Lite0 of the public port, for `change`; without it and without
            `start` the features are those of the package's weights.
        beside: weights of the change net that `clicks` learns to listen to; without it those of
            the package.

    Raises:
        InvalidInput: for too few steps, no rate, a start of another net, or another backbone.
        Conflict: when the folder holds a training with other settings.
        TrainingFailed: when the loss is not finite, or the weights cannot be written.
    """
    if settings.steps < LEAST_STEPS:
        raise InvalidInput(
            f"training of {net}: at least {LEAST_STEPS} iterations, not {settings.steps}"
        )
    if not settings.rate > 0:
        raise InvalidInput(f"training of {net}: lr must be > 0, but is {settings.rate}")
    torch.manual_seed(settings.seed)
    built: ClickNet | SiameseLite = ClickNet() if net == "clicks" else SiameseLite()
    began = _fill(built, WEIGHTS[net], start, backbone)
    known = data.record()
    detector = SiameseLiteDetector(str(beside or "")) if net == "clicks" else None
    if detector:
        began["beside"] = detector.weights
    identity: Identity = {"training": {"net": net, **asdict(settings), **began}, "data": known}
    claim(folder, identity)
    path, stopped = folder / f"{WEIGHTS[net]}.safetensors", folder / "state.pt"
    about = {
        "seed": str(settings.seed),
        "data_sha256": known["sha256"],
        "training": json.dumps(identity["training"], sort_keys=True),
    }

    def keep(fit: SmallFit[Any], losses: Mapping[str, float]) -> None:
        on_step(fit.done, losses)
        if fit.done % SAVE_EVERY and fit.done < settings.steps:
            return
        try:
            save_small(path, fit.average, WEIGHTS[net], {"steps": str(fit.done), **about})
            save_whole(stopped, fit.state())
        except OSError as error:
            raise TrainingFailed(
                f"step {fit.done}: the weights could not be written, {error};"
                f" {folder} keeps those before"
            ) from error
        on_saved(fit.done, path)

    state = read_weights(stopped) if stopped.exists() else None
    if isinstance(built, ClickNet):
        assert isinstance(settings, ClickTraining) and detector
        train_click_net(built, data.make, detector, settings, keep, state)
    else:
        assert isinstance(settings, ChangeTraining)
        train_change_net(built, data.make, settings, keep, state)
    return path


def _fill(net: nn.Module, name: str, start: Path | None, backbone: Path | None) -> dict[str, str]:
    """Give a net the weights it starts from; return their hashes."""
    if start:
        load_small(start, net, name)
        return {"start": hash_file(start)}
    if not isinstance(net, SiameseLite):
        return {}
    if backbone:
        try:
            net.features.load_public(bare_state(read_weights(backbone)))
        except (KeyError, RuntimeError) as error:
            reason = " ".join(str(error).split())[:200]
            raise InvalidInput(f"{backbone}: holds no EfficientNet-Lite0, {reason}") from error
        return {"backbone": hash_file(backbone)}
    shipped = SiameseLite()
    load_small(small_weights(name), shipped, name)
    net.features.load_state_dict(shipped.features.state_dict())
    return {"backbone": hash_file(small_weights(name))}
