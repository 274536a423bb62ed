"""Frozen records of the glossary's words, as the store hands them out.

One record a row, masks still as run-lengths: who needs pixels decodes them. Fields carry the units
of the schema (`db/README.md`).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from reviewer.doi import Region
from reviewer.geometry import Grid, Pose2
from reviewer.masks import Mask, Rle, decode_beside
from reviewer.metrics import Counts
from reviewer.words import (
    Choice,
    Method,
    Side,
    Verdict,
)


@dataclass(frozen=True, slots=True)
class OccupancyMap:
    """An occupancy grid image and its frame."""

    id: int
    path: Path
    grid: Grid


@dataclass(frozen=True, slots=True)
class Split:
    """One workspace x object group."""

    id: int
    name: str
    workspace: str | None
    object_group: int | None
    map_id: int | None


@dataclass(frozen=True, slots=True)
class Image:
    """An image file, size in pixels, viewpoint in the map when it has one."""

    id: int
    name: str
    path: Path
    sha256: str
    height: int
    width: int
    pose: Pose2 | None


@dataclass(frozen=True, slots=True)
class Pair:
    """A reference/live pair; `title` is "split/name", the way messages name it."""

    id: int
    split: str
    name: str
    reference: Image
    live: Image
    viewpoint_distance: float | None

    @property
    def title(self) -> str:
        return f"{self.split}/{self.name}"


@dataclass(frozen=True, slots=True)
class MaskRevision:
    """One revision of a pair's ground truth; number 0 does not exist, it means "none yet".

    Attributes:
        tool_log: the actions that led to it from its parent, in order.
    """

    pair_id: int
    number: int
    mask: Rle
    ignore_rle: str | None
    source: str
    annotator: str | None
    active_seconds: float
    created_at: str
    tool_log: tuple[dict[str, Any], ...] = ()

    def ignore(self) -> Mask | None:
        """Return the pixels not to score, bool (H, W); None where there are none."""
        return decode_beside(self.mask, self.ignore_rle)


@dataclass(frozen=True, slots=True)
class Run:
    """One execution of the pipeline with all its settings."""

    id: int
    name: str
    aligner: str
    detector: str
    segmenter: str
    settings: dict[str, Any]
    created_at: str


@dataclass(frozen=True, slots=True)
class ObjectInstance:
    """An open-vocabulary instance on the live or the warped reference image."""

    side: Side
    number: int
    label: str
    score: float
    mask: Rle


@dataclass(frozen=True, slots=True)
class StoredRegion:
    """A region under DoI with its key and the newest verdict on it."""

    id: int
    number: int
    region: Region
    labels: str
    verdict: Verdict | None
    audited_by: str | None
    verdict_reason: str = ""
    comment: str = ""

    @property
    def outcome(self) -> Choice:
        """What happens in the final mask: the verdict where there is one, else the decision."""
        if self.verdict is None or self.verdict == "agree":
            return self.region.choice
        return self.verdict


@dataclass(frozen=True, slots=True)
class Score:
    """Pixel counts of one method on one pair or pooled over a split."""

    run: str
    method: Method
    split: str
    pairs: int
    counts: Counts
