"""Train a small net, `clicks` or `change`, on photographs or on a database's reference images."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import fmean

from reviewer.dataset.files import hash_file, list_images
from reviewer.errors import InvalidInput, NotFound
from reviewer.flows.listening import NOBODY, Listener
from reviewer.store.database import Store
from reviewer.synthesis.bank import Bank
from reviewer.synthesis.shelf import Shelf
from reviewer.synthesis.views import ViewSettings
from reviewer.training.selection import select_references
from reviewer.training.small_session import VIEWS_PX, SmallData, SmallSettings, train_small
from reviewer.words import SmallNet, TrainedOn

TOLD_OVER = 50
"""Losses are told as means of so many steps: one alone says little."""

Backgrounds = list[tuple[Path, str]]
"""Image files, each with its SHA-256."""


def photographs(folder: Path) -> Backgrounds:
    """Return the images of a folder.

    Raises:
        NotFound: when it is no folder.
        InvalidInput: when it holds no image, or one whose name or place will not do.
    """
    if not folder.is_dir():
        raise NotFound(f"{folder}: is no folder of photographs")
    found, _ = list_images(folder, folder)
    if not found:
        raise InvalidInput(f"{folder}: holds no image; there should be photographs in it")
    return [(path, hash_file(path)) for path in found.values()]


def reference_images(store: Store, splits: Sequence[str], train_on: TrainedOn) -> Backgrounds:
    """Return a database's reference images; raises as `select_references`."""
    return [(image.path, image.sha256) for image in select_references(store, splits, train_on)]


def train_small_net(
    folder: Path,
    net: SmallNet,
    settings: SmallSettings,
    backgrounds: Backgrounds,
    bank: Bank,
    *,
    start: Path | None = None,
    backbone: Path | None = None,
    beside: Path | None = None,
    rooms: Sequence[Path] = (),
    listener: Listener = NOBODY,
) -> Path:
    """Train a small net in a folder, or go on there; return the file of its weights.

    Args:
        start, backbone, beside: as in `training.small_session.train_small`.
        rooms: files of rendered views (`synthesis.rendered`), beside the photographs.

    Raises:
        Conflict, InvalidInput, TrainingFailed: see `training.small_session.train_small`.
    """
    data = SmallData(
        Shelf([path for path, _ in backgrounds]),
        [sha256 for _, sha256 in backgrounds],
        bank,
        ViewSettings(side=VIEWS_PX[net]),
        rooms,
    )
    recent: deque[Mapping[str, float]] = deque(maxlen=TOLD_OVER)

    def told() -> str:
        means = {name: fmean(losses[name] for losses in recent) for name in recent[-1]}
        return ", ".join(f"loss of {name} {mean:.4f}" for name, mean in means.items())

    with listener.progress(folder.name) as advance:

        def step(done: int, losses: Mapping[str, float]) -> None:
            recent.append(losses)
            advance(done, settings.steps, told())

        return train_small(
            folder,
            net,
            settings,
            data,
            start=start,
            backbone=backbone,
            beside=beside,
            on_step=step,
            on_saved=lambda done, path: listener.say(
                f"{folder.name}, step {done} of {settings.steps}: {told()}; saved {path}"
            ),
        )
