"""Every setting of a training; the defaults are the paper's where it names one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from reviewer.errors import InvalidInput
from reviewer.models.nets.build import full_settings
from reviewer.words import Precision, Preprocessing

PAPER: dict[str, dict[str, Any]] = {
    "cscdnet": {"iterations": 40000, "batch": 32, "lr": 1e-4, "betas": (0.5, 0.999)},
    "dr-tanet": {"iterations": 15000, "batch": 16, "lr": 1e-3, "betas": (0.9, 0.999)},
}
"""Table and text of the paper; betas and the linear decay to 0 are those of the public codes."""
FAMILY = {
    "cdnet": "cscdnet",
    "cscdnet": "cscdnet",
    "cscdnet-attention": "cscdnet",
    "tanet": "dr-tanet",
    "dr-tanet": "dr-tanet",
}


@dataclass(frozen=True, slots=True)
class TrainingSettings:
    """How a net is fitted.

    Attributes:
        net, width, net_settings: see `nets.build.build_net`; defaults are filled in.
        iterations, batch, lr, betas: of Adam; the rate falls linearly to 0.
        decay_over: iterations after which the rate would be 0; None = at the end.
        class_weights: of unchanged and changed pixels in the loss.
        crop_px: side of the squares that are cut out of reference images, at their own size.
        preprocessing: how pictures become numbers.
        clip_norm: largest norm of the gradient; larger ones are scaled down, 0 = never.
        precision: "bfloat16" (mixed) where the device is faster in it, or as named.
        validate_every: iterations between two checkpoints, each with a validation.
        validation_pairs: synthetic pairs of a validation; never of the test data.
        held_out: share of the objects that only validation sees.
        seed: decides weights, pairs and their order.
    """

    net: str
    width: float = 1.0
    net_settings: Mapping[str, Any] = field(default_factory=dict)
    iterations: int = 40000
    batch: int = 32
    lr: float = 1e-4
    betas: tuple[float, float] = (0.5, 0.999)
    decay_over: int | None = None
    class_weights: tuple[float, float] = (1.0, 1.0)
    crop_px: int = 256
    preprocessing: Preprocessing = "bgr_128"
    clip_norm: float = 5.0
    precision: Precision = "auto"
    validate_every: int = 500
    validation_pairs: int = 64
    held_out: float = 0.15
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("iterations", "batch", "validate_every", "validation_pairs"):
            if getattr(self, name) < 1:
                raise InvalidInput(f"training {name}: must be >= 1, but is {getattr(self, name)}")
        object.__setattr__(self, "net_settings", full_settings(self.net, self.net_settings))
        if self.batch < 2:
            raise InvalidInput("training batch: batch norm needs at least 2 pairs, not 1")
        if self.crop_px < 64 or self.crop_px % 64:
            raise InvalidInput(f"training crop_px: a multiple of 64, but is {self.crop_px}")
        if self.decay_over is not None and self.decay_over < self.iterations:
            raise InvalidInput(
                f"training decay_over: must be >= iterations ({self.iterations}), but is"
                f" {self.decay_over}"
            )
        if not self.lr > 0:
            raise InvalidInput(f"training lr: must be > 0, but is {self.lr}")
        if not 0 < self.held_out < 1:
            raise InvalidInput(f"training held_out: must lie in (0, 1), but is {self.held_out}")
        if self.clip_norm < 0:
            raise InvalidInput(f"training clip_norm: must be >= 0, but is {self.clip_norm}")
        if not min(self.class_weights) > 0:
            raise InvalidInput(f"training class_weights: positive, but are {self.class_weights}")

    @property
    def threshold(self) -> float:
        """The counterpart of 0.5 without weights: a weight of w raises p / (1 - p) w-fold."""
        unchanged, changed = self.class_weights
        return changed / (unchanged + changed)

    @classmethod
    def of_paper(cls, net: str, **given: Any) -> TrainingSettings:
        """Return the paper's settings for a net, changed by those given.

        Raises:
            InvalidInput: for an unknown net, or a value outside its range.
        """
        if net not in FAMILY:
            raise InvalidInput(
                f"detector {net!r}: cannot be trained; there are {', '.join(FAMILY)}"
            )
        return cls(net, **{**PAPER[FAMILY[net]], **given})

    def record(self) -> dict[str, Any]:
        """Return the settings as plain JSON values."""
        values = asdict(self)
        return {k: list(v) if isinstance(v, tuple) else v for k, v in values.items()}
