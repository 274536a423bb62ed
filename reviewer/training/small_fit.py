"""A small net in training: AdamW over one cycle of its rate, and the average of its weights.

Both loops of the small nets, `click_loop` and `change_loop`, step with it. Its state is what a
training that was stopped goes on from.
"""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Mapping, Sequence
from typing import Any, Generic, TypeVar

import numpy as np
import torch
from torch import Tensor, nn

from reviewer.models.nets.small import channels_last
from reviewer.training.loop import TrainingFailed

Net = TypeVar("Net", bound=nn.Module)
WARMING = 0.1
"""Share of the steps in which the rate rises."""
DECAY = 1e-4
CLIP_NORM = 1.0


class SmallFit(Generic[Net]):
    """A net, its averaged weights, its optimiser and the generator of its views.

    Attributes:
        net, average: in training, and what is kept of it, ready to be used.
        rng: draws the views and everything else that is random.
        done: steps taken.
    """

    def __init__(
        self, net: Net, parts: Sequence[tuple[list[nn.Parameter], float]], *,
        steps: int, averaging: float, seed: int,
    ) -> None:  # fmt: skip
        """Begin a training.

        Args:
            parts: weights and their largest rate; only the gradient of the first part is limited.
            averaging: share of the average that a step leaves, after the first ones.
        """
        channels_last(net.train())
        self.net, self.average = net, copy.deepcopy(net).eval()
        self.rng = np.random.default_rng(seed)
        self.done = 0
        self._averaging, self._limited = averaging, parts[0][0]
        groups = [{"params": weights} for weights, _ in parts]
        rates = [rate for _, rate in parts]
        self._optimizer = torch.optim.AdamW(groups, lr=rates[0], weight_decay=DECAY)
        self._schedule = torch.optim.lr_scheduler.OneCycleLR(
            self._optimizer, rates, total_steps=steps, pct_start=WARMING
        )

    def descend(self, loss: Tensor) -> None:
        """Take a step down a loss.

        Raises:
            TrainingFailed: when the loss is not a finite number, before the weights take it over.
        """
        if not math.isfinite(loss.item()):
            raise TrainingFailed(
                f"step {self.done + 1}: loss {loss.item()} is not finite; try a lower --lr"
            )
        self._optimizer.zero_grad()
        torch.autograd.backward(loss)
        nn.utils.clip_grad_norm_(self._limited, CLIP_NORM)
        self._optimizer.step()
        self._schedule.step()
        self.done += 1
        average_into(self.average, self.net, min(self._averaging, self.done / (self.done + 9)))

    def state(self) -> dict[str, Any]:
        """Return what `go_on_from` takes, plain values and tensors."""
        return {
            "done": self.done,
            "net": self.net.state_dict(),
            "average": self.average.state_dict(),
            "optimizer": self._optimizer.state_dict(),
            "schedule": self._schedule.state_dict(),
            # Its numbers have 128 bits.
            "rng": json.dumps(self.rng.bit_generator.state),
        }

    def go_on_from(self, state: Mapping[str, Any]) -> None:
        """Take over a state of the same training."""
        self.done = int(state["done"])
        self.net.load_state_dict(state["net"])
        self.average.load_state_dict(state["average"])
        self._optimizer.load_state_dict(state["optimizer"])
        self._schedule.load_state_dict(state["schedule"])
        self.rng.bit_generator.state = json.loads(state["rng"])


@torch.no_grad()
def average_into(average: nn.Module, net: nn.Module, keep: float) -> None:
    """Move the averaged weights towards the net's; batch statistics are taken as they are."""
    for mine, theirs in zip(average.parameters(), net.parameters(), strict=True):
        mine.lerp_(theirs, 1 - keep)
    for held, found in zip(average.buffers(), net.buffers(), strict=True):
        held.copy_(found)
