"""A trained net as a detector of the pipeline: any size from 64 pixels, batches, one device.

Calls from several threads meet here: whoever finds the device free takes along the pairs of that
size that wait, up to `batch`. On a processor a batch gains nothing, so there it is 1 and a pair's
result does not depend on its company.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor, nn

from reviewer.errors import InvalidInput
from reviewer.masks import Mask
from reviewer.models.device import best_device, check_weights, choose_precision
from reviewer.models.interfaces import Field, Image, ModelFailed
from reviewer.models.nets.checkpoints import load_checkpoint
from reviewer.models.nets.pictures import (
    change_probability,
    pad_to_multiple,
    prepare,
    squeezed,
    stack_pair,
)
from reviewer.models.nets.record import NetRecord
from reviewer.models.nets.windows import through_windows
from reviewer.words import BatchNormMode, Precision

LEAST_SIDE = 64


@dataclass(slots=True, eq=False)
class _Job:
    """A pair that waits for the device, then its probability map."""

    pictures: npt.NDArray[np.uint8]
    probability: Field | None = None


@dataclass
class NetDetector:
    """Change probabilities by a checkpoint; its fields are a run's settings, filled in on loading.

    Attributes:
        net: registry name.
        checkpoint: path of the weights.
        weights: fingerprint of the weights; where given, the file must still hold those.
        bn_mode: "eval" or "batch"; None = as the checkpoint says.
        window: side of the windows in which large pictures are shown, pixels; 0 = whole; None = as
            the checkpoint says (see `nets.windows`).
        arithmetic: what else decides the probabilities, see `NetRecord.arithmetic`; where given,
            the file must still say so.
        precision: "bfloat16" where the device is faster in it ("auto"), or as named.
        batch: most pairs at a time; 0 = 8 on a GPU, 1 on a processor or with bn_mode "batch".
    """

    net: str
    checkpoint: str
    weights: str = ""
    arithmetic: Mapping[str, Any] | None = None
    bn_mode: BatchNormMode | None = None
    window: int | None = None
    precision: Precision = "auto"
    batch: int = 0
    record: NetRecord = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Load the weights.

        Raises:
            NotFound, InvalidInput: see `load_checkpoint`; or when the weights have changed.
        """
        self._module, self.record = load_checkpoint(Path(self.checkpoint), self.net)
        self.weights = check_weights(self.checkpoint, self._module, self.weights)
        self.arithmetic = _check_arithmetic(self.checkpoint, self.record, self.arithmetic)
        self._device = best_device()
        self.precision = choose_precision(self.precision, self._device)
        self.bn_mode = self.bn_mode or self.record.bn_mode
        if self.window is None:
            self.window = self.record.window_px
        if self.window and self.record.squeeze_px:
            raise InvalidInput(
                f"detector {self.net}: window is {self.window}, but {self.checkpoint} says that"
                f" pictures are squeezed to {self.record.squeeze_px} pixels; it has no windows"
            )
        if self.bn_mode == "batch":
            self.batch = 1  # the statistics are to be of one pair
        self.batch = self.batch or (8 if self._device == "cuda" else 1)
        self._module.to(self._device).eval()
        if self.bn_mode == "batch":
            _use_batch_statistics(self._module)
        self._waiting: list[_Job] = []
        self._list, self._turn = threading.Lock(), threading.Lock()

    @property
    def threshold(self) -> float:
        """The probability above which the checkpoint calls a pixel changed."""
        return self.record.threshold

    def detect(self, warped: Image, live: Image, valid: Mask) -> Field:
        """Return the probability of change, float32 (H, W); 0 outside `valid`.

        Raises:
            ModelFailed: when a side is shorter than 64 pixels.
        """
        height, width = live.shape[:2]
        if min(height, width) < LEAST_SIDE:
            raise ModelFailed(f"{self.net}: needs {LEAST_SIDE} pixels a side, not {width}x{height}")
        # Where nothing can be compared the net is shown twice the same, not an edge to black.
        shown = np.where(valid[..., None], warped, live)
        in_order = (shown, live) if self.record.first == "reference" else (live, shown)
        job = _Job(stack_pair(*in_order))
        with self._list:
            self._waiting.append(job)
        with self._turn:
            if job.probability is None:
                self._infer(self._take(job))
        assert job.probability is not None
        job.probability[~valid] = 0
        return job.probability

    def _take(self, job: _Job) -> list[_Job]:
        """Take a job, and others of its size, from the queue."""
        with self._list:
            others = [
                other
                for other in self._waiting
                if other is not job and other.pictures.shape == job.pictures.shape
            ]
            jobs = [job, *others[: self.batch - 1]]
            self._waiting = [waiting for waiting in self._waiting if waiting not in jobs]
        return jobs

    def _infer(self, jobs: list[_Job]) -> None:
        height, width = jobs[0].pictures.shape[1:]
        pictures = torch.from_numpy(np.stack([job.pictures for job in jobs])).to(self._device)
        try:
            if self.record.squeeze_px:
                probabilities = squeezed(self._look, pictures, self.record.squeeze_px)
            elif self.window:
                probabilities = through_windows(self._look, pictures, self.window)
            else:
                probabilities = self._look(pictures)
        except torch.OutOfMemoryError as error:
            raise ModelFailed(
                f"{self.net}: {len(jobs)} pairs of {width}x{height} do not fit into the memory of"
                f" {self._device}; use fewer --workers or smaller images"
            ) from error
        if not torch.isfinite(probabilities).all():
            raise ModelFailed(f"{self.net}: gave values that are not finite for this pair")
        for job, probability in zip(jobs, probabilities.cpu().numpy(), strict=True):
            job.probability = np.array(probability, np.float32)

    def _look(self, pictures: Tensor) -> Tensor:
        """Return probabilities (N, H, W) of uint8 pictures (N, 6, H, W) of any size."""
        height, width = pictures.shape[-2:]
        multiple: Any = self._module.multiple
        if self.bn_mode == "batch":
            multiple = 2 * multiple  # a deepest map of one pixel has no statistics
        inputs = pad_to_multiple(prepare(pictures, self.record.preprocessing), multiple)
        fast = torch.autocast(self._device, torch.bfloat16, enabled=self.precision == "bfloat16")
        with torch.inference_mode(), fast:
            logits = self._module(inputs)[..., :height, :width]
            return change_probability(logits, self.record.changed_class)


def _check_arithmetic(
    checkpoint: str, record: NetRecord, recorded: Mapping[str, Any] | None
) -> dict[str, Any]:
    found = record.arithmetic()
    if recorded is not None and found != recorded:
        raise InvalidInput(
            f"{checkpoint}: says {found}, but this run began with {dict(recorded)};"
            " give the new one a run of its own with --name"
        )
    return found


def _use_batch_statistics(module: nn.Module) -> None:
    """Let batch norms use what they see, without learning from it."""
    for part in module.modules():
        if isinstance(part, nn.BatchNorm2d):
            part.train()
            part.momentum = 0.0
