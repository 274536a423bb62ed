"""Train the click net: half of each batch is new, half are things that get their next click."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from reviewer.models.nets.click_net import ClickNet
from reviewer.models.nets.small import channels_last
from reviewer.training.aligned_views import AlignedViews
from reviewer.training.click_examples import Episode, begin


@dataclass(frozen=True, slots=True)
class ClickTraining:
    """How the click net is trained.

    Attributes:
        steps, batch, rate: of AdamW, one cycle. averaging: of the weights that are kept.
        rating: weight of the rating's loss beside the mask's.
        seed: of the views and the simulated annotators.
    """

    steps: int = 9000
    batch: int = 32
    rate: float = 2.5e-3
    averaging: float = 0.998
    rating: float = 1.0
    seed: int = 0


def train_click_net(
    net: ClickNet,
    views: Callable[[np.random.Generator], AlignedViews],
    settings: ClickTraining,
    tell: Callable[[int, dict[str, float], ClickNet], None],
) -> ClickNet:
    """Train in place; return the net of averaged weights.

    Args:
        tell: called after each step with its number, its losses and the averaged net.
    """
    rng = np.random.default_rng(settings.seed)
    fresh = _episodes(views, rng)
    channels_last(net.train())
    average = copy.deepcopy(net).eval()
    optimizer = torch.optim.AdamW(net.parameters(), lr=settings.rate, weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimizer, settings.rate, total_steps=settings.steps, pct_start=0.1
    )
    carried: list[Episode] = []
    for step in range(settings.steps):
        episodes = carried[: settings.batch // 2]
        episodes += [next(fresh) for _ in range(settings.batch - len(episodes))]
        windows = torch.from_numpy(np.stack([e.window() for e in episodes]))
        targets = [e.target() for e in episodes]
        truth, counts = (torch.from_numpy(np.stack(part)) for part in zip(*targets, strict=True))
        with torch.autocast("cpu", torch.bfloat16):
            logits, rating = net(windows.to(memory_format=torch.channels_last))
        logits, rating = logits.float(), rating.float()
        masking, guessing = _losses(logits, rating, truth, counts)
        optimizer.zero_grad()
        torch.autograd.backward(masking + settings.rating * guessing)
        torch.nn.utils.clip_grad_norm_(net.parameters(), 1.0)
        optimizer.step()
        schedule.step()
        average_into(average, net, min(settings.averaging, (step + 1) / (step + 10)))
        probabilities = torch.sigmoid(logits.detach()).numpy()
        carried = [
            e for e, p in zip(episodes, probabilities, strict=True)
            if rng.random() < 0.9 and e.follow(p, rng)
        ]  # fmt: skip
        carried = [carried[k] for k in rng.permutation(len(carried))]
        tell(step, {"mask": masking.item(), "rating": guessing.item()}, average)
    return average


def _episodes(
    views: Callable[[np.random.Generator], AlignedViews], rng: np.random.Generator
) -> Iterator[Episode]:
    while True:
        yield from begin(views(rng), rng)


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


@torch.no_grad()
def average_into(average: torch.nn.Module, net: torch.nn.Module, keep: float) -> None:
    """Move the averaged weights towards the net's; batch statistics are taken as they are."""
    for mine, theirs in zip(average.parameters(), net.parameters(), strict=True):
        mine.lerp_(theirs, 1 - keep)
    for held, found in zip(average.buffers(), net.buffers(), strict=True):
        held.copy_(found)
