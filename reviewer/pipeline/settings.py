"""Every setting of a run, as one record that is stored with it."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from importlib.metadata import version
from typing import Any

from reviewer.doi import HIGH, LOW
from reviewer.errors import InvalidInput
from reviewer.version import VERSION
from reviewer.words import Overlaps, Scope, Seen

IMPORTED = "imported"
"""An aligner, detector or segmenter whose output came from elsewhere (`reviewer import-layer`)."""


DEFAULT_ALIGNER = "dis"


@dataclass(frozen=True, slots=True)
class PipelineSettings:
    """Members by registry name, their own settings, and how DoI integrates them.

    Attributes:
        aligner, detector, labeller, segmenter: registry names; all but the labeller may be
            "imported".
        model_settings: settings of each member by stage ("align", "detect", "label", "search");
            defaults where empty. A run's record holds all of them.
        threshold: a pixel is changed where its probability exceeds this; None = as the
            detector says, which is 0.5 (the paper) unless a checkpoint says otherwise.
        scope, low, high, max_overlap_px, overlaps, touching_only, seen: see
            `reviewer.doi.integrate`.
    """

    aligner: str = DEFAULT_ALIGNER
    detector: str = "siamese-lite"
    labeller: str = "none"
    segmenter: str = "object-net"
    model_settings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    threshold: float | None = None
    scope: Scope = "component"
    low: float = LOW
    high: float = HIGH
    max_overlap_px: int = 0
    overlaps: Overlaps = "best"
    touching_only: bool = False
    seen: Seen = "keep"

    def __post_init__(self) -> None:
        if self.threshold is not None and not 0 <= self.threshold < 1:
            raise InvalidInput(f"threshold: must lie in [0, 1), but is {self.threshold}")
        if not 0 <= self.low <= self.high:
            raise InvalidInput(
                f"DoI thresholds: need 0 <= low <= high, not {self.low} and {self.high}"
            )
        if self.max_overlap_px < 0:
            raise InvalidInput(f"max_overlap_px: must be >= 0, but is {self.max_overlap_px}")

    def doi_rule(self) -> dict[str, Any]:
        """Return what `reviewer.doi.integrate` takes of the settings."""
        return {
            "scope": self.scope,
            "low": self.low,
            "high": self.high,
            "max_overlap_px": self.max_overlap_px,
            "overlaps": self.overlaps,
            "touching_only": self.touching_only,
            "seen": self.seen,
        }

    def record(self) -> dict[str, Any]:
        """Return the settings as plain JSON values."""
        return asdict(self)

    @classmethod
    def of_record(cls, record: Mapping[str, Any]) -> PipelineSettings:
        """Return the settings of a stored run.

        Raises:
            InvalidInput: when the record has settings this version does not know.
        """
        unknown = sorted(set(record) - {f.name for f in fields(cls)})
        if unknown:
            raise InvalidInput(f"run settings: {', '.join(unknown)} unknown to this version")
        return cls(**record)

    def default_name(self) -> str:
        """Return a name from members and rule: dis-difference-oversegment-component."""
        labeller = [] if self.labeller == "none" else [self.labeller]
        rule = [self.scope] if self.seen == "keep" else [self.scope, self.seen]
        return "-".join([self.aligner, self.detector, *labeller, self.segmenter, *rule])


def current_versions() -> dict[str, str]:
    """Return the versions that decide results."""
    return {
        "reviewer": VERSION,
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "opencv": version("opencv-python-headless"),
        "scikit-image": version("scikit-image"),
    }
