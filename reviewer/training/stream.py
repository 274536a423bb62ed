"""Training pairs as an endless, numbered stream of batches.

Pair n of a stream depends on the seed and n alone: worker processes do not change what a net sees,
and a training that goes on after a kill sees what it would have seen.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor
from torch.utils.data import DataLoader, Dataset

from reviewer.models.nets.pictures import stack_pair
from reviewer.synthesis.bank import Bank
from reviewer.synthesis.pairs import TRAINING, VALIDATION, SyntheticPair, numbered_pair
from reviewer.synthesis.settings import SynthesisSettings
from reviewer.training.settings import TrainingSettings

Image = npt.NDArray[np.uint8]


CHANGED, IGNORED = 1, -100
"""Classes of pixels beside 0 = unchanged; nothing is learnt from an ignored one."""


class NumberedPairs(Dataset[tuple[Tensor, Tensor]]):
    """Pair n: uint8 pictures (6, side, side) and int64 classes (side, side)."""

    def pair(self, number: int) -> SyntheticPair:
        """Return a pair as pictures."""
        raise NotImplementedError

    def __getitem__(self, number: int) -> tuple[Tensor, Tensor]:
        """Return a pair as tensors."""
        pair = self.pair(number)
        pictures = stack_pair(pair.reference, pair.live)
        return torch.from_numpy(pictures), torch.from_numpy(pair.mask.astype(np.int64) * CHANGED)


class SyntheticPairs(NumberedPairs):
    """Pairs made of reference images and pasted objects."""

    def __init__(
        self,
        references: Sequence[Image],
        bank: Bank,
        settings: SynthesisSettings,
        *,
        side: int,
        seed: int,
        stream: int,
    ) -> None:
        """Keep what pairs are made of."""
        self.references, self.bank, self.settings = references, bank, settings
        self.side, self.seed, self.stream = side, seed, stream

    def pair(self, number: int) -> SyntheticPair:
        """Return a pair as pictures."""
        return numbered_pair(
            self.references,
            self.bank,
            self.settings,
            seed=self.seed,
            stream=self.stream,
            number=number,
            side=self.side,
        )


@dataclass(frozen=True, slots=True)
class SyntheticData:
    """What synthetic pairs are made of, and what the record says of it.

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
    kind: str = "synthetic"

    def parts(self) -> dict[str, dict[str, Any]]:
        """Return what identifies this training data, as plain JSON values."""
        return {"synthesis": self.synthesis.record(), "data": dict(self.record)}

    def streams(self, settings: TrainingSettings) -> tuple[NumberedPairs, NumberedPairs]:
        """Return pairs to train on and to validate on; no object is in both."""
        held = self.bank.split(settings.held_out)
        training, validation = (
            SyntheticPairs(
                self.references,
                bank,
                self.synthesis,
                side=settings.crop_px,
                seed=settings.seed,
                stream=stream,
            )
            for bank, stream in zip(held, (TRAINING, VALIDATION), strict=True)
        )
        return training, validation


def batches(
    pairs: NumberedPairs, *, first: int, last: int, batch: int, workers: int
) -> Iterator[tuple[Tensor, Tensor]]:
    """Yield batches `first` .. `last` - 1: pictures (N, 6, H, W) and classes (N, H, W).

    Args:
        workers: processes that make pairs ahead; 0 makes them here.
    """
    loader = DataLoader(
        pairs,
        batch_size=batch,
        sampler=range(first * batch, last * batch),
        num_workers=workers,
        # A forked child would inherit the threads of torch and SQLite half alive.
        multiprocessing_context="spawn" if workers else None,
        worker_init_fn=_one_thread if workers else None,
    )
    yield from loader


def _one_thread(_: int) -> None:
    cv2.setNumThreads(1)
