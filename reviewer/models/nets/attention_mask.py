"""The Siamese attention mask (Takeda et al., IROS 2022), as we read it.

Published are the aim (fewer false positives on shadows and reflections), the place (an intermediate
layer of the siamese encoder, input and output layers unchanged) and the source (features used in
visual place recognition); no code, no equation. Our reading: the features of one level of both
encoders are multiplied by

    strength * mask + (1 - strength)

where mask, in [0, 1], says of every place of *that* image how much descriptor energy it has. What
is smooth (a shadow, a glare on a floor) has little, and its features count less. The mask has no
weights, so a CSCDNet checkpoint fits with and without it. A mask source is a function in `SOURCES`.
"""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor, nn
from torch.nn import functional

from reviewer.errors import InvalidInput

MaskSource = Callable[[Tensor, Tensor], Tensor]
"""(features (N, C, h, w), image (N, 3, H, W)) -> energy (N, 1, h, w), >= 0."""


def descriptor_energy(features: Tensor, image: Tensor) -> Tensor:
    """Return the length of each place's descriptor, as place recognition pools it (GeM, R-MAC)."""
    lengths: Tensor = torch.linalg.vector_norm(features, dim=1, keepdim=True)
    return lengths


def texture_energy(features: Tensor, image: Tensor) -> Tensor:
    """Return the mean gradient of the picture under each place; needs no trained features."""
    grey = image.mean(1, keepdim=True)
    across = functional.pad(grey.diff(dim=3).abs(), (0, 1))
    down = functional.pad(grey.diff(dim=2).abs(), (0, 0, 0, 1))
    return functional.adaptive_avg_pool2d(across + down, (features.shape[2], features.shape[3]))


SOURCES: dict[str, MaskSource] = {
    "descriptor-energy": descriptor_energy,
    "texture-energy": texture_energy,
}
LEVELS = range(2, 6)
BRIGHTEST = 0.95
"""The quantile of an image's energies that becomes 1: one glint must not darken all the rest."""


class AttentionMask(nn.Module):
    """Damps features where an image says little; a hook of CSCDNet's encoders."""

    def __init__(
        self, level: int = 3, strength: float = 0.5, source: str | MaskSource = "descriptor-energy"
    ) -> None:
        """Choose where and how much.

        Args:
            level: which features: 2 (a quarter of the size) to 5 (1/32).
            strength: lambda, from 0 (no effect) to 1 (places without energy vanish).
            source: a name in SOURCES, or a function of that kind.

        Raises:
            InvalidInput: for an unknown source, or level or strength outside their ranges.
        """
        super().__init__()
        if level not in LEVELS:
            raise InvalidInput(f"attention level: must be 2 to 5, but is {level}")
        if not 0 <= strength <= 1:
            raise InvalidInput(f"attention strength: must lie in [0, 1], but is {strength}")
        if isinstance(source, str) and source not in SOURCES:
            raise InvalidInput(f"attention source {source!r}: there are {', '.join(SOURCES)}")
        self.level, self.strength = level, strength
        self._source = SOURCES[source] if isinstance(source, str) else source

    def forward(self, features: Tensor, image: Tensor) -> Tensor:
        """Return the damped features."""
        return features * (self.strength * self.mask(features, image) + (1 - self.strength))

    def mask(self, features: Tensor, image: Tensor) -> Tensor:
        """Return the mask (N, 1, h, w) in [0, 1]; no gradient flows through it."""
        with torch.no_grad():
            energy = self._source(features, image).float()
            high = energy.flatten(1).quantile(BRIGHTEST, dim=1)[:, None, None, None]
            mask = (energy / high.clamp_min(1e-6)).clamp(max=1)
        return mask.to(features.dtype)
