"""The models of a run, built from its settings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from reviewer.errors import InvalidInput
from reviewer.models.interfaces import Aligner, Detector, Labeller, Segmenter
from reviewer.models.registry import (
    build_aligner,
    build_labeller,
    build_segmenter,
    open_detector,
    segmenter_reads,
    settings_of,
)
from reviewer.pipeline.settings import IMPORTED, PipelineSettings

PAPER_THRESHOLD = 0.5


@dataclass(frozen=True, slots=True)
class Members:
    """The models of a run; None where the output is imported."""

    aligner: Aligner | None
    detector: Detector | None
    labeller: Labeller
    segmenter: Segmenter | None

    def settings(self) -> dict[str, dict[str, Any]]:
        """Return the settings in force by stage, weights' fingerprints among them."""
        members = {
            "align": self.aligner,
            "detect": self.detector,
            "label": self.labeller,
            "search": self.segmenter,
        }
        return {stage: settings_of(m) for stage, m in members.items() if m is not None}

    def remarks(self) -> list[str]:
        """Return what is assumed because a checkpoint does not say it, one sentence each."""
        record = getattr(self.detector, "record", None)
        if record is None:
            return []
        return [
            f"{record.net}: {name} {record.settings[name]} is assumed; the file does not tell"
            f" (`reviewer checkpoint FILE --{name} --save NEW` writes it down)"
            for name in record.assumed
        ]

    def threshold(self) -> float:
        """Return the probability above which the detector calls a pixel changed."""
        return float(getattr(self.detector, "threshold", PAPER_THRESHOLD))


def build_members(settings: PipelineSettings) -> Members:
    """Build the models that a run names.

    Raises:
        InvalidInput: for an unknown name or setting, weights that cannot be loaded, or a segmenter
            that searches for names when nothing names any.
    """
    own = settings.model_settings
    aligner, detector, segmenter = settings.aligner, settings.detector, settings.segmenter
    if settings.labeller == "none" and "labels" in segmenter_reads(segmenter):
        raise InvalidInput(
            f"segmenter {segmenter}: searches for names, but labeller none gives none; use"
            " --labeller vocabulary:FILE.json, llava or llava-alpha"
        )
    return Members(
        None if aligner == IMPORTED else build_aligner(aligner, own.get("align")),
        None if detector == IMPORTED else open_detector(detector, own.get("detect")),
        build_labeller(settings.labeller, own.get("label")),
        None if segmenter == IMPORTED else build_segmenter(segmenter, own.get("search")),
    )
