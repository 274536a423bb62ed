"""Synthetic pairs as an endless, numbered stream of batches.

Pair n of a stream depends on the seed and n alone: worker processes do not change what a net sees,
and a training that goes on after a kill sees what it would have seen.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import cv2
import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor
from torch.utils.data import DataLoader, Dataset

from reviewer.models.nets.pictures import stack_pair
from reviewer.synthesis.bank import Bank
from reviewer.synthesis.pairs import SyntheticPair, numbered_pair
from reviewer.synthesis.settings import SynthesisSettings

Image = npt.NDArray[np.uint8]


class SyntheticPairs(Dataset[tuple[Tensor, Tensor]]):
    """Pair n: uint8 pictures (6, side, side) and int64 classes (side, side), 1 = changed."""

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

    def __getitem__(self, number: int) -> tuple[Tensor, Tensor]:
        """Return a pair as tensors."""
        pair = self.pair(number)
        pictures = stack_pair(pair.reference, pair.live)
        return torch.from_numpy(pictures), torch.from_numpy(pair.mask.astype(np.int64))


def batches(
    pairs: SyntheticPairs, *, first: int, last: int, batch: int, workers: int
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
