"""Train the small Siamese change net on views that the pipeline's own aligner brought together."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from reviewer.models.nets.siamese_lite import SiameseLite
from reviewer.models.nets.small import channels_last
from reviewer.training.aligned_views import AlignedViews
from reviewer.training.click_loop import average_into


@dataclass(frozen=True, slots=True)
class ChangeTraining:
    """How the change net is trained.

    Attributes:
        steps, batch, rate: of AdamW, one cycle. feature_rate: share of the rate that the ImageNet
            features learn at; 0 = they stay. averaging: of the weights that are kept.
        seed: of the views.
    """

    steps: int = 4000
    batch: int = 8
    rate: float = 2e-3
    feature_rate: float = 0.0
    averaging: float = 0.997
    seed: int = 0


def train_change_net(
    net: SiameseLite,
    views: Callable[[np.random.Generator], AlignedViews],
    settings: ChangeTraining,
    tell: Callable[[int, dict[str, float], SiameseLite], None],
) -> SiameseLite:
    """Train in place; return the net of averaged weights."""
    rng = np.random.default_rng(settings.seed)
    channels_last(net.train())
    average = copy.deepcopy(net).eval()
    features = list(net.features.parameters())
    for parameter in features:
        parameter.requires_grad_(settings.feature_rate > 0)
    own = [p for n, p in net.named_parameters() if not n.startswith("features.")]
    groups = [{"params": own}]
    rates = [settings.rate]
    if settings.feature_rate > 0:
        groups.append({"params": features})
        rates.append(settings.rate * settings.feature_rate)
    optimizer = torch.optim.AdamW(groups, lr=settings.rate, weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimizer, rates, total_steps=settings.steps, pct_start=0.1
    )
    for step in range(settings.steps):
        pairs = [views(rng) for _ in range(settings.batch)]
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
        optimizer.zero_grad()
        torch.autograd.backward(loss)
        torch.nn.utils.clip_grad_norm_(own, 1.0)
        optimizer.step()
        schedule.step()
        average_into(average, net, min(settings.averaging, (step + 1) / (step + 10)))
        tell(step, {"change": loss.item()}, average)
    return average


def _loss(logits: Tensor, truth: Tensor, valid: Tensor) -> Tensor:
    """Return binary entropy, soft Dice over the batch, and soft Dice of each pair that has some."""
    entropy = functional.binary_cross_entropy_with_logits(logits, truth, reduction="none")
    counted = (entropy * valid).sum() / valid.sum().clamp(min=1)
    own, there = torch.sigmoid(logits) * valid, truth * valid
    dice = 1 - 2 * (own * there).sum() / ((own + there).sum() + 1)
    some = there.sum(dim=(1, 2)) > 0
    single = 1 - (2 * (own * there).sum(dim=(1, 2)) + 1) / ((own + there).sum(dim=(1, 2)) + 1)
    return 2 * counted + dice + (single * some).sum() / some.sum().clamp(min=1)
