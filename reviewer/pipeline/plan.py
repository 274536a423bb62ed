"""Which stages of a pair are still to be done, and the keys of their inputs.

    align ─▶ detect ─▶ label ─▶ search ─▶ integrate

A stage's key hashes its settings (weights included) and the keys of what it reads, down to the
hashes of the two images. So another DoI threshold gives another key to `integrate` alone, two
detectors have one key for their alignment, and an edited label changes what follows from it and
nothing else. All keys are known before anything is computed.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from reviewer.models.registry import PATHS
from reviewer.pipeline.settings import IMPORTED, PipelineSettings
from reviewer.records import Pair
from reviewer.store.results import GIVEN
from reviewer.words import STAGES, Reads, Stage

# Raised when a stage's own code changes what it makes of the same inputs.
STAGE_VERSIONS: dict[Stage, int] = {
    "align": 1,
    "detect": 1,
    "label": 1,
    "search": 1,
    "integrate": 2,
}


@dataclass(frozen=True, slots=True)
class PairPlan:
    """Stages of a pair: `keys` of all that are needed, `todo` in their order."""

    keys: dict[Stage, str]
    todo: tuple[Stage, ...]


class Plan:
    """How a run's stages depend on each other and on its settings."""

    def __init__(self, settings: PipelineSettings, reads: frozenset[Reads]) -> None:
        """Take the settings of a prepared run, and what its segmenter reads."""
        labels = {"label"} if "labels" in reads else set()
        change = {"detect"} if reads else set()
        self.inputs: dict[Stage, tuple[Stage, ...]] = {
            "align": (),
            "detect": ("align",),
            "label": ("detect",),
            "search": tuple(s for s in STAGES if s in {"align", *labels, *change}),
            "integrate": ("align", "detect", "search"),
        }
        self._own = {stage: _own_settings(settings, stage) for stage in STAGES}
        # The label of a vocabulary hangs on the split, which no image tells.
        self._split_matters = settings.labeller == "vocabulary"

    def of_pair(
        self, pair: Pair, have: Mapping[Stage, str], wanted: Sequence[Stage] = STAGES
    ) -> PairPlan:
        """Return what is to be done for a pair that has results of the keys `have`."""
        keys: dict[Stage, str] = {}
        for stage in STAGES:
            kept = have.get(stage, "")
            keys[stage] = kept if kept.startswith(GIVEN) else self._key(stage, pair, keys)
        return PairPlan(keys, tuple(s for s in STAGES if s in wanted and have.get(s) != keys[s]))

    def _key(self, stage: Stage, pair: Pair, keys: Mapping[Stage, str]) -> str:
        record = [
            stage,
            STAGE_VERSIONS[stage],
            self._own[stage],
            [pair.reference.sha256, pair.live.sha256],
            [keys[read] for read in self.inputs[stage]],
            pair.split if stage == "label" and self._split_matters else None,
        ]
        return hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()[:32]


def _own_settings(settings: PipelineSettings, stage: Stage) -> dict[str, Any]:
    """Return the settings that change what a stage makes, and no others."""
    members = {
        "align": settings.aligner,
        "detect": settings.detector,
        "label": settings.labeller,
        "search": settings.segmenter,
    }
    if stage == "integrate":
        rule = settings.doi_rule()
        # Results of before there was another `seen` are still what "keep" makes.
        return rule if rule["seen"] != "keep" else {k: v for k, v in rule.items() if k != "seen"}
    own = {"member": members[stage], **settings.model_settings.get(stage, {})}
    if own.get("weights"):
        # What counts is what is in the files, not where they lie.
        own = {name: value for name, value in own.items() if name not in PATHS}
    if not own.get("arithmetic"):
        own.pop("arithmetic", None)  # results of before it was noted are still what it makes
    if stage == "detect" and settings.detector != IMPORTED:
        own["threshold"] = settings.threshold
    return own
