"""What F of a detector is when the two pictures are swapped: each scored pair is detected again.

The alignment stays, and so does the frame: the detector is shown the live picture as the warped
reference, and the warped reference as the live picture. What has changed between two pictures is
the same whichever is called the earlier one, so the answer is held against the same truth on the
same pixels. A detector that compares falls little; one that has learnt what new things look like,
or what disappears from the first picture, falls to what is left without that.

To align the other way round instead would change the pixels and the frame as well, and F would fall
for three reasons at once. Nothing is stored. Called by `reviewer runs compare --swapped`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from reviewer.dataset.pictures import read_picture
from reviewer.errors import InvalidInput, ReviewerError
from reviewer.evaluation.counting import counts_of_masks
from reviewer.evaluation.predicting import Interval
from reviewer.evaluation.protocols import Protocol, paired_change, protocol_lines
from reviewer.metrics import Counts
from reviewer.models.interfaces import Detector, ModelFailed, find_change
from reviewer.models.registry import open_detector
from reviewer.pipeline.fields import store_detection
from reviewer.pipeline.settings import IMPORTED, PipelineSettings
from reviewer.pipeline.stored import warped_view
from reviewer.records import Pair, Run
from reviewer.store.database import Store
from reviewer.store.pairs import pairs_of_ids
from reviewer.store.scores import PairScore, mask_pair, pair_scores


@dataclass(frozen=True, slots=True)
class Swapped:
    """F of a run's detector alone, as it was and with the two pictures swapped.

    Attributes:
        splits: one row per split, and their mean.
        change: of the mean F by that, with its 95 % interval over pairs.
        failures: pairs that could not be detected again, with the reason; they are in no figure.
    """

    run: str
    splits: list[dict[str, Any]]
    change: Interval
    failures: list[str]

    def record(self) -> dict[str, Any]:
        """Return it as plain JSON values."""
        return asdict(self)


def swap_pictures(
    store: Store,
    run: Run,
    progress: Callable[[int, int, str], None] = lambda done, total, pair: None,
    detector: Detector | None = None,
) -> Swapped:
    """Detect the scored pairs of a run again with the two pictures swapped.

    Args:
        progress: called with pairs done, pairs in all, and the pair that is next.
        detector: that of the run, where it is built already.

    Raises:
        InvalidInput: when the run's detections were imported, or its detector cannot be built.
    """
    settings = PipelineSettings.of_record(run.settings)
    if settings.detector == IMPORTED:
        raise InvalidInput(
            f"run {run.name}: its detections were imported, so they cannot be made again with the"
            " two pictures swapped"
        )
    assert settings.threshold is not None, "a prepared run names its threshold"
    model = detector or open_detector(settings.detector, settings.model_settings.get("detect"))
    scores = {score.pair_id: score for score in pair_scores(store, run.name) if _alone(score)}
    before: list[PairScore] = []
    after: list[PairScore] = []
    failures: list[str] = []
    for done, pair in enumerate(pairs_of_ids(store, list(scores))):
        progress(done, len(scores), pair.title)
        try:
            usual, other = _count_both(store, run, pair, model, settings.threshold)
        except ReviewerError as error:
            failures.append(f"pair {pair.title}: {error}")
            continue
        before.append(replace(scores[pair.id], counts=usual))
        after.append(replace(scores[pair.id], counts=other))
    lines = [protocol_lines(found, Protocol()) for found in (before, after)]
    splits = [
        {
            "run": run.name,
            "split": a.split,
            "pairs": a.pairs,
            "F": a.f_score,
            "swapped": b.f_score,
            "change": b.f_score - a.f_score,
        }
        for a, b in zip(*lines, strict=True)
    ]
    return Swapped(run.name, splits, paired_change(before, after), failures)


def _alone(score: PairScore) -> bool:
    return score.method == "base"


def _count_both(
    store: Store, run: Run, pair: Pair, detector: Detector, threshold: float
) -> tuple[Counts, Counts]:
    """Return the counts of M_o as it was and with the pictures swapped, where both can be seen.

    Raises:
        ReviewerError: when there is no alignment, a picture cannot be read, or the detector fails.
    """
    warped, valid, confidence = warped_view(store, run, pair)
    live = read_picture(pair.live)
    probability = find_change(detector, live, warped, valid, confidence)
    if not np.isfinite(probability).all():
        raise ModelFailed("detector: gave probabilities that are not finite for this pair")
    usual = mask_pair(store, run.id, pair.id, "base")
    other = replace(usual, prediction=store_detection(probability, threshold).mask)
    return counts_of_masks(usual), counts_of_masks(other)
