"""Training pairs cut from ground truth: pictures of a `t0t1` folder, masks 0, 1 and 255 = ignore.

Squares are cut at random, half of them around a changed pixel, mirrored or not, each picture under
another light: two drives of one room differ in that, and there are far fewer labelled pairs than
synthetic ones, which may be mixed in. Nothing is learnt from ignored pixels.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from reviewer.dataset.files import read_grey
from reviewer.errors import InvalidInput
from reviewer.models.nets.pictures import stack_pair
from reviewer.synthesis.jitter import photograph, relight
from reviewer.synthesis.pairs import TRAINING, VALIDATION, SyntheticPair, pair_rng
from reviewer.synthesis.settings import SynthesisSettings
from reviewer.synthesis.shelf import ROOM_BYTES, Shelf
from reviewer.training.settings import TrainingSettings
from reviewer.training.stream import CHANGED, IGNORED, NumberedPairs, SyntheticData

IGNORE_LEVEL = 255
MIXING = 7
"""A stream of random numbers beside those of training and validation."""


@dataclass(frozen=True, slots=True)
class LabelledFiles:
    """Files of one pair: reference (as the net will see it), live, mask; hashes of all three."""

    title: str
    reference: Path
    live: Path
    mask: Path
    sha256: str


class LabelledPairs(NumberedPairs):
    """Pair n: a square of a labelled pair."""

    def __init__(
        self, files: Sequence[LabelledFiles], *, side: int, seed: int, stream: int
    ) -> None:
        """Remember the files; they are read when they are wanted."""
        room = ROOM_BYTES // 2
        self.past = Shelf([each.reference for each in files], room)
        self.live = Shelf([each.live for each in files], room)
        self.files, self.side, self.seed, self.stream = list(files), side, seed, stream
        # Of synthesis only what another hour of the day does; nothing is pasted.
        self.light = SynthesisSettings(homography_px=0, flow_px=0)

    def square(self, number: int) -> tuple[SyntheticPair, np.ndarray]:
        """Return pair `number` as pictures, and its levels uint8 (side, side): 0, 1, 255.

        Raises:
            InvalidInput: when the pictures of a pair are smaller than the square.
        """
        rng = pair_rng(self.seed, self.stream, number)
        place = int(rng.integers(0, len(self.files)))
        past, present = self.past[place], self.live[place]
        levels = read_grey(self.files[place].mask)
        top, left = _corner(levels, self.side, rng, self.files[place].title)
        cut = np.s_[top : top + self.side, left : left + self.side]
        past, present, levels = past[cut], present[cut], levels[cut]
        if rng.random() < 0.5:
            past, present, levels = past[:, ::-1], present[:, ::-1], levels[:, ::-1]
        if self.stream == TRAINING:
            past, present = (
                photograph(
                    relight(picture.astype(np.float32), self.light, rng),
                    self.light,
                    rng,
                    blurred=False,
                )
                for picture in (past, present)
            )
        return SyntheticPair(past, present, levels == CHANGED), levels

    def pair(self, number: int) -> SyntheticPair:
        """Return a pair as pictures."""
        return self.square(number)[0]

    def __getitem__(self, number: int) -> tuple[Tensor, Tensor]:
        """Return a pair as tensors."""
        pair, levels = self.square(number)
        classes = levels.astype(np.int64)
        classes[levels == IGNORE_LEVEL] = IGNORED
        return torch.from_numpy(stack_pair(pair.reference, pair.live)), torch.from_numpy(classes)


def _corner(levels: np.ndarray, side: int, rng: np.random.Generator, title: str) -> tuple[int, int]:
    """Return top and left of a square: anywhere, or (every other one) over a changed pixel."""
    height, width = levels.shape
    if min(height, width) < side:
        raise InvalidInput(f"pair {title}: a crop of {side} pixels, but it is {width}x{height}")
    changed = np.flatnonzero(levels == CHANGED)
    if len(changed) and rng.random() < 0.5:
        y, x = divmod(int(changed[int(rng.integers(0, len(changed)))]), width)
        top, left = y - int(rng.integers(0, side)), x - int(rng.integers(0, side))
    else:
        top, left = int(rng.integers(0, height)), int(rng.integers(0, width))
    return min(max(top, 0), height - side), min(max(left, 0), width - side)


class MixedPairs(NumberedPairs):
    """Pair n: of the second stream for a share of the numbers, else of the first."""

    def __init__(
        self, first: NumberedPairs, second: NumberedPairs, share: float, *, seed: int
    ) -> None:
        """Take two streams; `share` in [0, 1] is the second's."""
        self.first, self.second, self.share, self.seed = first, second, share, seed

    def _of(self, number: int) -> NumberedPairs:
        chosen = pair_rng(self.seed, MIXING, number).random() < self.share
        return self.second if chosen else self.first

    def pair(self, number: int) -> SyntheticPair:
        """Return a pair as pictures."""
        return self._of(number).pair(number)

    def __getitem__(self, number: int) -> tuple[Tensor, Tensor]:
        """Return a pair as tensors."""
        return self._of(number)[number]


@dataclass(frozen=True, slots=True)
class LabelledData:
    """Labelled pairs to train on and to validate on.

    Attributes:
        training, validation: none is in both.
        record: plain JSON values: the fold, and how it was made.
        synthetic: pairs that are mixed into the training, a share of `share`.
    """

    training: Sequence[LabelledFiles]
    validation: Sequence[LabelledFiles]
    record: Mapping[str, Any]
    kind: str = "labelled"
    synthetic: SyntheticData | None = None
    share: float = 0.0

    def parts(self) -> dict[str, dict[str, Any]]:
        """Return what identifies this training data, as plain JSON values."""
        hashes = [[files.sha256 for files in part] for part in (self.training, self.validation)]
        digest = hashlib.sha256(json.dumps(hashes).encode()).hexdigest()
        counts = {"training": len(self.training), "validation": len(self.validation)}
        data = {**self.record, **counts, "sha256": digest}
        if self.synthetic is None:
            return {"data": data}
        mixed = self.synthetic.parts()
        return {"data": {**data, "share": self.share, "synthetic": mixed["data"]["sha256"]},
                "synthesis": mixed["synthesis"]}  # fmt: skip

    def streams(self, settings: TrainingSettings) -> tuple[NumberedPairs, NumberedPairs]:
        """Return squares to train on and to validate on."""
        training, validation = (
            LabelledPairs(files, side=settings.crop_px, seed=settings.seed, stream=stream)
            for files, stream in ((self.training, TRAINING), (self.validation, VALIDATION))
        )
        if self.synthetic is None:
            return training, validation
        pasted, _ = self.synthetic.streams(settings)
        return MixedPairs(training, pasted, self.share, seed=settings.seed), validation
