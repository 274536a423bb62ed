"""The record of a net's weights: all that a run needs to use them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from reviewer.errors import InvalidInput
from reviewer.models.nets.build import full_settings, untold_settings
from reviewer.words import (
    BATCH_NORM_MODES,
    PREPROCESSINGS,
    SIDES,
    BatchNormMode,
    Preprocessing,
    Side,
)


@dataclass(frozen=True, slots=True)
class NetRecord:
    """The record of a net's weights.

    Attributes:
        net, width, settings: see `build_net`; those that no key tells are always in it.
        preprocessing: see `pictures.prepare`.
        bn_mode: "eval" uses the statistics of training; "batch" those of the pair at hand, as the
            public CSCDNet test code does.
        threshold: a pixel is changed where its probability exceeds this.
        changed_class: which of the two logits speaks for change (polarity).
        window_px: side of the windows in which pictures are shown to the net; 0 = whole, as the
            public codes do.
        squeeze_px: side of the square that pictures are squeezed to for the net, as some public
            codes do; 0 = they keep their size.
        first: which of the two pictures the net sees first.
        training: settings, seed, data hash and scores of the training; empty for public ones.
        assumed: settings that a bare file does not tell and nobody has given.
    """

    net: str
    width: float = 1.0
    settings: Mapping[str, Any] = field(default_factory=dict)
    preprocessing: Preprocessing = "bgr_128"
    bn_mode: BatchNormMode = "eval"
    threshold: float = 0.5
    changed_class: int = 1
    window_px: int = 0
    squeeze_px: int = 0
    first: Side = "reference"
    training: Mapping[str, Any] = field(default_factory=dict)
    assumed: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "settings", {**untold_settings(self.net), **self.settings})
        if self.preprocessing not in PREPROCESSINGS:
            known = ", ".join(PREPROCESSINGS)
            raise InvalidInput(f"preprocessing {self.preprocessing!r}: there are {known}")
        if self.bn_mode not in BATCH_NORM_MODES:
            raise InvalidInput(f"bn_mode {self.bn_mode!r}: there are eval, batch")
        if not 0 <= self.threshold < 1:
            raise InvalidInput(f"threshold: must lie in [0, 1), but is {self.threshold}")
        if self.window_px < 0 or self.window_px % 64:
            raise InvalidInput(f"window_px: 0 or a multiple of 64, but is {self.window_px}")
        if self.squeeze_px < 0 or (self.squeeze_px and self.window_px):
            raise InvalidInput(
                f"squeeze_px: 0 or positive, and 0 where there are windows, but is"
                f" {self.squeeze_px} beside a window_px of {self.window_px}"
            )
        if self.first not in SIDES:
            raise InvalidInput(f"first: must be reference or live, but is {self.first!r}")
        if self.changed_class not in (0, 1):
            raise InvalidInput(f"changed_class: must be 0 or 1, but is {self.changed_class}")

    def arithmetic(self) -> dict[str, Any]:
        """Return what determines the probabilities of a pair besides the weights.

        Only what differs from a net's defaults as early versions had them: the keys of their
        results stay what they are.
        """
        early = {
            **full_settings(self.net, {}),
            "preprocessing": "bgr_128",
            "changed_class": 1,
            "squeeze_px": 0,
            "first": "reference",
        }
        if "relu" in early:
            early["relu"] = "stage"
        own = {
            **self.settings,
            "preprocessing": self.preprocessing,
            "changed_class": self.changed_class,
            "squeeze_px": self.squeeze_px,
            "first": self.first,
        }
        return {name: value for name, value in own.items() if value != early.get(name)}
