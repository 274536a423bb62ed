"""Fit a net: one optimiser step after the other, with a validation in between.

The state of a training is the net, the optimiser and the number of the next iteration; everything
else follows from settings and seed. So a training that was stopped goes on to the same weights.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

from reviewer.errors import ReviewerError
from reviewer.metrics import Counts, count
from reviewer.models.device import best_device, choose_precision
from reviewer.models.nets.pictures import change_probability, prepare
from reviewer.training.settings import TrainingSettings
from reviewer.training.stream import CHANGED, IGNORED, NumberedPairs, batches


class TrainingFailed(ReviewerError):
    """A training cannot continue; its last checkpoint is unchanged."""

    status = 422


@dataclass(frozen=True, slots=True)
class Step:
    """One iteration: its number from 1, loss, gradient norm, learning rate, pairs a second."""

    iteration: int
    loss: float
    gradient_norm: float
    lr: float
    pairs_per_s: float


class Fit:
    """A net in training."""

    def __init__(self, net: nn.Module, settings: TrainingSettings) -> None:
        """Put the net on the device and make its optimiser."""
        self.settings, self.iteration = settings, 0
        self.device = best_device()
        self.net = net.to(self.device)
        self.precision = choose_precision(settings.precision, self.device)
        self.optimiser = torch.optim.Adam(net.parameters(), lr=settings.lr, betas=settings.betas)
        self._weights = torch.tensor(
            settings.class_weights, dtype=torch.float32, device=self.device
        )

    def state(self) -> dict[str, Any]:
        """Return the state needed to resume."""
        return {
            "iteration": self.iteration,
            "net": self.net.state_dict(),
            "optimiser": self.optimiser.state_dict(),
        }

    def go_on_from(self, state: dict[str, Any]) -> None:
        """Resume from a state that `state` returned."""
        self.net.load_state_dict(state["net"])
        self.optimiser.load_state_dict(state["optimiser"])
        self.iteration = int(state["iteration"])

    def steps(self, pairs: NumberedPairs, *, until: int, workers: int) -> Iterator[Step]:
        """Do iterations up to `until`, yielding each.

        Raises:
            TrainingFailed: when the loss is not a finite number, before the weights take it over;
                or when a batch does not fit into memory.
        """
        batch = self.settings.batch
        for pictures, classes in batches(
            pairs, first=self.iteration, last=until, batch=batch, workers=workers
        ):
            start = time.perf_counter()
            horizon = self.settings.decay_over or self.settings.iterations
            lr = self.settings.lr * (1 - self.iteration / horizon)
            for group in self.optimiser.param_groups:
                group["lr"] = lr
            self.net.train()
            self.optimiser.zero_grad(set_to_none=True)
            try:
                loss = self._loss(pictures, classes)
                value = float(loss.detach())
                loss.backward()  # type: ignore[no-untyped-call]
            except torch.OutOfMemoryError as error:
                raise TrainingFailed(
                    f"iteration {self.iteration + 1}: {batch} squares of {self.settings.crop_px}"
                    f" pixels do not fit into the memory of {self.device}; lower --batch or --crop"
                ) from error
            limit = self.settings.clip_norm or math.inf
            norm = float(nn.utils.clip_grad_norm_(self.net.parameters(), limit))
            if not (math.isfinite(value) and math.isfinite(norm)):
                raise TrainingFailed(
                    f"iteration {self.iteration + 1}: loss {value}, gradient norm {norm}; not"
                    " finite, so the training stopped before this step. Try a lower --lr,"
                    " or --precision float32"
                )
            self.optimiser.step()
            self.iteration += 1
            seconds = time.perf_counter() - start
            yield Step(self.iteration, value, norm, lr, batch / seconds)

    def validate(self, pairs: NumberedPairs) -> Counts:
        """Return pixel counts over the validation's pairs, pooled, by the larger of both logits.

        The net is left as it was.
        """
        self.net.eval()
        counts = Counts()
        size = min(self.settings.batch, self.settings.validation_pairs)
        numbers = range(self.settings.validation_pairs)
        with torch.inference_mode():
            for start in range(0, len(numbers), size):
                made = [pairs[k] for k in numbers[start : start + size]]
                logits = self._logits(torch.stack([pictures for pictures, _ in made]))
                found = change_probability(logits, CHANGED) > 0.5
                classes = torch.stack([classes for _, classes in made]).flatten(0, 1).numpy()
                ignored = classes == IGNORED
                counts += count(found.flatten(0, 1).cpu().numpy(), classes == CHANGED, ignored)
        return counts

    def _loss(self, pictures: Tensor, classes: Tensor) -> Tensor:
        logits = self._logits(pictures)
        return functional.cross_entropy(
            logits.float(),
            classes.to(self.device),
            weight=self._weights,
            ignore_index=IGNORED,
        )

    def _logits(self, pictures: Tensor) -> Tensor:
        inputs = prepare(pictures.to(self.device), self.settings.preprocessing)
        fast = self.precision == "bfloat16"
        with torch.autocast(self.device, torch.bfloat16, enabled=fast):
            logits: Tensor = self.net(inputs)
        return logits
