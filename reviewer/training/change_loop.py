"""Train the small Siamese change net on views that the pipeline's own aligner brought together."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from reviewer.models.nets.siamese_lite import SiameseLite
from reviewer.training.aligned_views import AlignedViews
from reviewer.training.small_fit import SmallFit


@dataclass(frozen=True, slots=True)
class ChangeTraining:
    """How the change net is trained.

    Attributes:
        steps, batch, rate: of AdamW, one cycle. feature_rate: share of the rate that the ImageNet
            features learn at; 0 = they stay. averaging: of the weights that are kept.
        seed: of the views.
    """

    steps: int = 2800
    batch: int = 8
    rate: float = 2e-3
    feature_rate: float = 0.0
    averaging: float = 0.997
    seed: int = 0


def train_change_net(
    net: SiameseLite,
    views: Callable[[np.random.Generator], AlignedViews],
    settings: ChangeTraining,
    tell: Callable[[SmallFit[SiameseLite], dict[str, float]], None],
    state: Mapping[str, Any] | None = None,
) -> SiameseLite:
    """Train in place; return the net of averaged weights.

    Args:
        tell: called after each step with where the training stands, and the losses.
        state: of a training that was stopped, from `SmallFit.state`; it goes on to the same end.
    """
    features = list(net.features.parameters())
    parts = [
        ([p for n, p in net.named_parameters() if not n.startswith("features.")], settings.rate)
    ]
    if settings.feature_rate > 0:
        parts.append((features, settings.rate * settings.feature_rate))
    fit = SmallFit(
        net, parts, steps=settings.steps, averaging=settings.averaging, seed=settings.seed
    )
    for parameter in features:
        parameter.requires_grad_(settings.feature_rate > 0)
    if state:
        fit.go_on_from(state)
    while fit.done < settings.steps:
        pairs = [views(fit.rng) for _ in range(settings.batch)]
        pictures = (
            torch.from_numpy(np.stack([getattr(p, name) for p in pairs]))
            .permute(0, 3, 1, 2).float().to(memory_format=torch.channels_last)
            for name in ("live", "warped")
        )  # fmt: skip
        valid = np.stack([p.valid for p in pairs])
        confidence = torch.from_numpy(np.stack([p.confidence for p in pairs]) * valid)[:, None]
        truth = torch.from_numpy(np.stack([p.change for p in pairs])).float()
        with torch.autocast("cpu", torch.bfloat16):
            logits = net(*pictures, confidence)
        loss = _loss(logits.float(), truth, torch.from_numpy(valid).float())
        fit.descend(loss)
        tell(fit, {"change": loss.item()})
    return fit.average


def _loss(logits: Tensor, truth: Tensor, valid: Tensor) -> Tensor:
    """Return binary entropy, soft Dice over the batch, and soft Dice of each pair that has some."""
    entropy = functional.binary_cross_entropy_with_logits(logits, truth, reduction="none")
    counted = (entropy * valid).sum() / valid.sum().clamp(min=1)
    own, there = torch.sigmoid(logits) * valid, truth * valid
    dice = 1 - 2 * (own * there).sum() / ((own + there).sum() + 1)
    some = there.sum(dim=(1, 2)) > 0
    single = 1 - (2 * (own * there).sum(dim=(1, 2)) + 1) / ((own + there).sum(dim=(1, 2)) + 1)
    return 2 * counted + dice + (single * some).sum() / some.sum().clamp(min=1)
