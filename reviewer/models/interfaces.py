"""The protocols of the pipeline's models.

Images are uint8 RGB (H, W, 3), masks bool (H, W), fields float32. Everything is in the frame of the
live image unless it says otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from reviewer.errors import ReviewerError
from reviewer.masks import Mask

Image = npt.NDArray[np.uint8]
Field = npt.NDArray[np.float32]
Embedding = Mapping[str, npt.NDArray[np.float32]]
"""What a click segmenter knows of an image; its own business, but for being arrays."""


class ModelFailed(ReviewerError):
    """A model could not do this pair (say, too few matches); the run records it and goes on."""

    status = 422


@dataclass(frozen=True, slots=True)
class Alignment:
    """Where the live view's pixels lie in the reference image.

    Attributes:
        flow: float32 (H, W, 2), (dx, dy) in pixels: live (x, y) shows reference (x + dx, y + dy).
        valid: bool (H, W), live pixels that the reference can be compared with; the others are
            unseen.
        backward: the flow from reference to live, float32 (h, w, 2) in the reference's frame, found
            independently of `flow`; None where the aligner has none.
        confidence: float32 (H, W) in [0, 1], how sure the aligner is that the reference shows what
            lies at a live pixel and that the flow finds it; None where it does not say.
    """

    flow: Field
    valid: Mask
    backward: Field | None = None
    confidence: Field | None = None


@dataclass(frozen=True, slots=True)
class Instance:
    """A segmented object: bool (H, W) mask, label ('' = none), score in [0, 1]."""

    mask: Mask
    label: str
    score: float


@dataclass(frozen=True, slots=True)
class Objects:
    """Instances of O_l and of O_r, both in the live frame."""

    live: tuple[Instance, ...]
    reference: tuple[Instance, ...]


class Aligner(Protocol):
    """Finds the alignment of a pair."""

    def align(self, reference: Image, live: Image) -> Alignment:
        """Raises ModelFailed when the pair cannot be aligned."""
        ...


class Detector(Protocol):
    """Finds changed pixels."""

    def detect(self, warped: Image, live: Image, valid: Mask) -> Field:
        """Return the probability of change, float32 (H, W) in [0, 1]; 0 outside `valid`."""
        ...


@runtime_checkable
class ConfidentDetector(Protocol):
    """A detector that also reads how sure the alignment is, where the aligner says so."""

    def detect_confident(self, warped: Image, live: Image, valid: Mask, confidence: Field) -> Field:
        """Return what `Detector.detect` does; `confidence` as in `Alignment`."""
        ...


def find_change(
    detector: Detector, warped: Image, live: Image, valid: Mask, confidence: Field | None
) -> Field:
    """Return what a detector finds, float32 (H, W), with the confidence where it reads one."""
    if confidence is not None and isinstance(detector, ConfidentDetector):
        return detector.detect_confident(warped, live, valid, confidence)
    return detector.detect(warped, live, valid)


@dataclass(frozen=True, slots=True)
class Said:
    """A labeller's answer about a component of M_o, or about the whole mask (component None).

    Attributes:
        raw: its words.
        label: the name in them, "" = nothing to search for, and then `note` says why.
    """

    component: int | None
    raw: str
    label: str
    note: str = ""


class Labeller(Protocol):
    """Names what has changed, for the segmenter to search."""

    def name(self, live: Image, change: Mask, split: str) -> tuple[Said, ...]:
        """Return what is said of M_o on the live image; nothing for an empty mask."""
        ...


@dataclass(frozen=True, slots=True)
class PairView:
    """What a segmenter may look at.

    Attributes:
        live, warped: the live image, and the reference warped to it.
        valid: bool (H, W), where the warp has pixels.
        change: M_o, bool (H, W); empty for a segmenter that does not read it.
        labels: names to search for, each once, none of them empty; none for a segmenter that does
            not read them.
        reference, flow: the reference as it was taken, and the flow that warps it.
        confidence: as in `Alignment`; None where the aligner does not say.
    """

    live: Image
    warped: Image
    valid: Mask
    change: Mask
    labels: tuple[str, ...]
    reference: Image
    flow: Field
    confidence: Field | None = None


class Segmenter(Protocol):
    """Finds objects on both images; `registry.SEGMENTER_READS` says what else it looks at."""

    def segment(self, view: PairView) -> Objects:
        """Return instances of O_l and O_r, both in the live frame."""
        ...


@dataclass(frozen=True, slots=True)
class Click:
    """A point that belongs to the object (positive) or does not; image coordinates, pixels."""

    x: float
    y: float
    positive: bool = True


@dataclass(frozen=True, slots=True)
class Prompt:
    """What a person said about one object so far.

    Attributes:
        clicks: in the order they were made.
        box_xyxy: a box around the object.
        previous: bool (H, W), the mask that the last click corrects.
    """

    clicks: tuple[Click, ...] = ()
    box_xyxy: tuple[float, float, float, float] | None = None
    previous: Mask | None = None


@dataclass(frozen=True, slots=True)
class Candidate:
    """A proposed object mask: bool (H, W), and the model's own guess of its IoU in [0, 1]."""

    mask: Mask
    score: float


@dataclass(frozen=True, slots=True)
class ClickPictures:
    """What `ClickSegmenter.embed` takes."""

    image: Image
    other: Image | None = None
    confidence: Field | None = None
    change: Field | None = None


class ClickSegmenter(Protocol):
    """Finds the object that a person points at: embed an image once, then predict per click."""

    @property
    def model_id(self) -> str:
        """Name and weights of the model; part of the key under which embeddings are kept."""
        ...

    @property
    def keeps_embeddings(self) -> bool:
        """Whether an embedding costs enough to be kept on disk."""
        ...

    def embed(
        self,
        image: Image,
        other: Image | None,
        confidence: Field | None = None,
        change: Field | None = None,
    ) -> Embedding:
        """Prepare an image; what is known beside it is in the same frame, the live one.

        Args:
            other: shows the same view at the other time, None without one.
            confidence: how sure the alignment of the two is, as in `Alignment`; None where nobody
                says.
            change: float32 (H, W) in [0, 1], a detector's probability of change; None without one.
        """
        ...

    def predict(self, embedding: Embedding, prompt: Prompt) -> list[Candidate]:
        """Return candidates of the embedded image's size, best first; at least one."""
        ...
