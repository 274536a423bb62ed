"""Train the click net: half of each batch is new, half are things that get their next click."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from reviewer.models.interfaces import ConfidentDetector, Field
from reviewer.models.nets.click_net import ClickNet
from reviewer.training.aligned_views import AlignedViews
from reviewer.training.click_examples import Episode, begin
from reviewer.training.said_changes import said_of
from reviewer.training.small_fit import SmallFit

CLICKED_IN, RECENT = 3, 24
"""How often views are clicked in, at the mean, and how many are at hand for it: making views and
asking the detector costs as much as a step."""


@dataclass(frozen=True, slots=True)
class ClickTraining:
    """How the click net is trained.

    Attributes:
        steps, batch, rate: of AdamW, one cycle. averaging: of the weights that are kept.
        rating: weight of the rating's loss beside the mask's.
        seed: of the views and the simulated annotators.
    """

    steps: int = 4600
    batch: int = 32
    rate: float = 2.5e-3
    averaging: float = 0.998
    rating: float = 1.0
    seed: int = 0


def train_click_net(
    net: ClickNet,
    views: Callable[[np.random.Generator], AlignedViews],
    detector: ConfidentDetector,
    settings: ClickTraining,
    tell: Callable[[SmallFit[ClickNet], dict[str, float]], None],
    state: Mapping[str, Any] | None = None,
) -> ClickNet:
    """Train in place; return the net of averaged weights.

    Args:
        detector: tells the net what changed in the views, as far as `said_of` lets it.
        tell: called after each step with where the training stands, and the losses.
        state: of a training that was stopped, from `SmallFit.state`. The things that were under
            clicks then are not in it, so what follows is as good, but not the same.
    """
    parts = [(list(net.parameters()), settings.rate)]
    fit = SmallFit(
        net, parts, steps=settings.steps, averaging=settings.averaging, seed=settings.seed
    )
    if state:
        fit.go_on_from(state)
    rng = fit.rng
    fresh = _episodes(views, detector, rng)
    carried: list[Episode] = []
    while fit.done < settings.steps:
        episodes = carried[: settings.batch // 2]
        episodes += [next(fresh) for _ in range(settings.batch - len(episodes))]
        windows = torch.from_numpy(np.stack([e.window() for e in episodes]))
        targets = [e.target() for e in episodes]
        truth, counts = (torch.from_numpy(np.stack(part)) for part in zip(*targets, strict=True))
        with torch.autocast("cpu", torch.bfloat16):
            logits, rating = net(windows.to(memory_format=torch.channels_last))
        logits, rating = logits.float(), rating.float()
        masking, guessing = _losses(logits, rating, truth, counts)
        fit.descend(masking + settings.rating * guessing)
        probabilities = torch.sigmoid(logits.detach()).numpy()
        carried = [
            e for e, p in zip(episodes, probabilities, strict=True)
            if rng.random() < 0.9 and e.follow(p, rng)
        ]  # fmt: skip
        carried = [carried[k] for k in rng.permutation(len(carried))]
        tell(fit, {"mask": masking.item(), "rating": guessing.item()})
    return fit.average


def _episodes(
    views: Callable[[np.random.Generator], AlignedViews],
    detector: ConfidentDetector,
    rng: np.random.Generator,
) -> Iterator[Episode]:
    recent: deque[tuple[AlignedViews, Field]] = deque(maxlen=RECENT)
    while True:
        seen = views(rng)
        recent.append((seen, said_of(seen, detector, rng)))
        for _ in range(CLICKED_IN):
            yield from begin(*recent[int(rng.integers(len(recent)))], rng)


def _losses(logits: Tensor, rating: Tensor, truth: Tensor, counts: Tensor) -> tuple[Tensor, Tensor]:
    """Return the mask's loss (normalised focal and soft Dice) and the rating's."""
    solid = (truth > 0.5).float()
    entropy = functional.binary_cross_entropy_with_logits(logits, truth, reduction="none")
    probability = torch.sigmoid(logits)
    wrong = (probability - truth).abs()
    focus = (wrong**2 * counts).detach()
    # Normalised: what is hard counts alike in easy and in hard windows (RITM).
    focal = (focus * entropy).sum(dim=(1, 2)) / focus.sum(dim=(1, 2)).clamp(min=8.0)
    own = probability * counts
    dice = 1 - (2 * (own * truth).sum(dim=(1, 2)) + 1) / (
        (own + truth * counts).sum(dim=(1, 2)) + 1
    )
    found = (probability.detach() > 0.5).float() * counts
    both = (found * solid).sum(dim=(1, 2))
    iou = both / (found + solid - found * solid).sum(dim=(1, 2)).clamp(min=1)
    guess = functional.binary_cross_entropy_with_logits(rating, iou)
    return (focal + dice).mean(), guess
