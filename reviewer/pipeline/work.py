"""One pair through its stages: arrays and models only, no store.

A task holds all that a stage may need of earlier ones, an outcome all that is to be written, so the
work can be done in any process on any machine. Later stages read the kept flow and the kept 8-bit
probabilities, never the originals: a resumed run gives the same bytes as an uninterrupted one.
"""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from reviewer.dataset.pictures import read_picture
from reviewer.doi import integrate_crops
from reviewer.errors import NotFound, ReviewerError
from reviewer.masks import Mask, crop_of_rle, decode_rle, encode_rle, merge_rles
from reviewer.models.interfaces import (
    Field,
    Image,
    Instance,
    ModelFailed,
    PairView,
    find_change,
)
from reviewer.models.registry import segmenter_reads
from reviewer.models.warping import warp_image
from reviewer.pipeline.fields import (
    load_confidence,
    load_flow,
    store_alignment,
    store_detection,
)
from reviewer.pipeline.members import Members
from reviewer.pipeline.settings import PipelineSettings
from reviewer.records import ObjectInstance, Pair
from reviewer.store.layers import StoredAlignment, StoredDetection, StoredLabel
from reviewer.store.regions import StoredIntegration
from reviewer.store.results import Content, StageResult
from reviewer.words import SIDES, Side, Stage


@dataclass(slots=True)
class Known:
    """The results of a pair so far; None = not yet."""

    alignment: StoredAlignment | None = None
    detection: StoredDetection | None = None
    labels: Sequence[StoredLabel] | None = None
    objects: Sequence[ObjectInstance] | None = None


@dataclass(frozen=True, slots=True)
class PairTask:
    """A pair, the stages to do with their keys, and what earlier stages left."""

    pair: Pair
    todo: tuple[tuple[Stage, str], ...]
    known: Known


@dataclass(slots=True)
class PairReport:
    """What was done for a pair, and the stage that failed with the reason."""

    pair: Pair
    results: list[StageResult] = field(default_factory=list)
    failure: tuple[Stage, str] | None = None


class PairWorker:
    """Does tasks of one run with one set of models."""

    def __init__(self, settings: PipelineSettings, members: Members) -> None:
        self._settings = settings
        self._members = members

    def do(self, task: PairTask) -> PairReport:
        """Do the stages of a task until one fails; a failure is an outcome, never an exception."""
        outcome = PairReport(task.pair)
        bench = Bench(self._settings, self._members, task.pair, task.known)
        for stage, key in task.todo:
            try:
                seconds, content = bench.do(stage)
            except ReviewerError as error:
                outcome.failure = stage, str(error)
                break
            except Exception as error:  # a model may raise anything; the other pairs go on
                outcome.failure = stage, _say(error)
                break
            outcome.results.append(StageResult(stage, key, seconds, content))
        return outcome


def _say(error: Exception) -> str:
    place = traceback.extract_tb(error.__traceback__)[-1]
    reason = " ".join(str(error).split()) or "no message"
    return f"{type(error).__name__}: {reason} ({Path(place.filename).name}:{place.lineno})"


class Bench:
    """One pair under work: its images are read once, and only if a stage looks at them."""

    def __init__(
        self, settings: PipelineSettings, members: Members, pair: Pair, known: Known
    ) -> None:
        self._settings, self._members = settings, members
        self._pair, self._known = pair, known

    def do(self, stage: Stage) -> tuple[float, Content]:
        """Do one stage; return seconds and what it made.

        Raises:
            ReviewerError: when an image cannot be read, a model fails, or an earlier stage is
                missing.
        """
        stages: dict[Stage, Callable[[], Content]] = {
            "align": self._align,
            "detect": self._detect,
            "label": self._label,
            "search": self._search,
            "integrate": self._integrate,
        }
        start = time.perf_counter()
        content = stages[stage]()
        return time.perf_counter() - start, content

    @cached_property
    def live(self) -> Image:
        return read_picture(self._pair.live)

    @cached_property
    def reference(self) -> Image:
        return read_picture(self._pair.reference)

    @cached_property
    def _warp(self) -> tuple[Image, Mask]:
        alignment = self._aligned()
        return warp_image(self.reference, load_flow(alignment)), decode_rle(alignment.valid)

    @cached_property
    def _confidence(self) -> Field | None:
        return load_confidence(self._aligned())

    def _aligned(self) -> StoredAlignment:
        if self._known.alignment is None:
            raise NotFound(f"pair {self._pair.title}: is not aligned; do the stage align first")
        return self._known.alignment

    def _detected(self) -> StoredDetection:
        if self._known.detection is None:
            raise NotFound(f"pair {self._pair.title}: has no detection; do the stage detect first")
        return self._known.detection

    def _align(self) -> StoredAlignment:
        if self._members.aligner is None:
            raise NotFound(f"pair {self._pair.title}: has no imported alignment")
        alignment = self._members.aligner.align(self.reference, self.live)
        if not np.isfinite(alignment.flow).all():
            raise ModelFailed("aligner: gave a flow that is not finite for this pair")
        self._known.alignment = store_alignment(alignment, self.reference, self.live)
        return self._known.alignment

    def _detect(self) -> StoredDetection:
        if self._members.detector is None:
            raise NotFound(f"pair {self._pair.title}: has no imported detection")
        assert self._settings.threshold is not None, "a prepared run names its threshold"
        warped, valid = self._warp
        probability = find_change(
            self._members.detector, warped, self.live, valid, self._confidence
        )
        if not np.isfinite(probability).all():
            raise ModelFailed("detector: gave probabilities that are not finite for this pair")
        self._known.detection = store_detection(probability, self._settings.threshold)
        return self._known.detection

    def _label(self) -> Sequence[StoredLabel]:
        change = decode_rle(self._detected().mask)
        said = self._members.labeller.name(self.live, change, self._pair.split)
        self._known.labels = [StoredLabel(s.component, s.raw, s.label, s.note) for s in said]
        return self._known.labels

    def _search(self) -> Sequence[ObjectInstance]:
        if self._members.segmenter is None:
            # Imported objects are there already; where there are none, none were found.
            self._known.objects = self._known.objects or []
            return self._known.objects
        warped, valid = self._warp
        reads = segmenter_reads(self._settings.segmenter)
        change, named = np.zeros_like(valid), []
        if "change" in reads:
            change = decode_rle(self._detected().mask)
        if "labels" in reads:
            named = [label.label for label in self._known.labels or () if label.label]
        view = PairView(
            self.live,
            warped,
            valid,
            change,
            tuple(dict.fromkeys(named)),
            self.reference,
            load_flow(self._aligned()),
            self._confidence,
        )
        found = self._members.segmenter.segment(view)
        self._known.objects = [
            _object(side, number, thing, change.shape)
            for side, things in zip(SIDES, (found.live, found.reference), strict=True)
            for number, thing in enumerate(things)
        ]
        return self._known.objects

    def _integrate(self) -> StoredIntegration:
        detection, objects = self._detected(), self._known.objects
        if objects is None:
            raise NotFound(
                f"pair {self._pair.title}: objects were not searched; do the stage search first"
            )
        alignment = self._known.alignment
        change = detection.mask
        past = [thing.mask for thing in objects if thing.side == "reference"]
        result = integrate_crops(
            decode_rle(change),
            [crop_of_rle(thing.mask) for thing in objects if thing.side == "live"],
            merge_rles(past, change.height, change.width),
            valid=decode_rle(alignment.valid) if alignment else None,
            **self._settings.doi_rule(),
        )
        return StoredIntegration(result.regions, change, encode_rle(result.mask))


def _object(side: Side, number: int, thing: Instance, shape: tuple[int, ...]) -> ObjectInstance:
    """Return an instance as it is kept.

    Raises:
        ModelFailed: for a mask of another size or kind, or a score outside [0, 1].
    """
    if thing.mask.dtype != bool or thing.mask.shape != shape:
        raise ModelFailed(
            f"segmenter: {side} object {number} is {thing.mask.dtype} {thing.mask.shape}, but a"
            f" mask here is bool {shape}"
        )
    if not 0 <= thing.score <= 1:
        raise ModelFailed(f"segmenter: {side} object {number} has the score {thing.score}")
    return ObjectInstance(side, number, thing.label, thing.score, encode_rle(thing.mask))
