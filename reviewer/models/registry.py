"""Build models by name; unknown names are told which there are.

Builders import their module when called, so naming a model costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any, TypeVar

from reviewer.errors import InvalidInput
from reviewer.models.interfaces import Aligner, Detector, Segmenter

Model = TypeVar("Model")


def _homography(**settings: Any) -> Aligner:
    from reviewer.models.aligners import HomographyAligner

    return HomographyAligner(**settings)


def _dis(**settings: Any) -> Aligner:
    from reviewer.models.aligners import DisAligner

    return DisAligner(**settings)


def _difference(**settings: Any) -> Detector:
    from reviewer.models.detectors import DifferenceDetector

    return DifferenceDetector(**settings)


def _oversegment(**settings: Any) -> Segmenter:
    from reviewer.models.segmenters import OversegmentSegmenter

    return OversegmentSegmenter(**settings)


ALIGNERS: dict[str, Callable[..., Aligner]] = {"dis": _dis, "homography": _homography}
DETECTORS: dict[str, Callable[..., Detector]] = {"difference": _difference}
SEGMENTERS: dict[str, Callable[..., Segmenter]] = {"oversegment": _oversegment}


def build_aligner(name: str, settings: Mapping[str, Any] | None = None) -> Aligner:
    """Return an aligner; raises InvalidInput for an unknown name or setting."""
    return _build("aligner", ALIGNERS, name, settings)


def build_detector(name: str, settings: Mapping[str, Any] | None = None) -> Detector:
    """Return a detector; raises InvalidInput for an unknown name or setting."""
    return _build("detector", DETECTORS, name, settings)


def build_segmenter(name: str, settings: Mapping[str, Any] | None = None) -> Segmenter:
    """Return a segmenter; raises InvalidInput for an unknown name or setting."""
    return _build("segmenter", SEGMENTERS, name, settings)


def settings_of(model: Any) -> dict[str, Any]:
    """Return the settings of a model, for the run's record."""
    return {field.name: getattr(model, field.name) for field in fields(model)}


def _build(
    kind: str,
    builders: Mapping[str, Callable[..., Model]],
    name: str,
    settings: Mapping[str, Any] | None,
) -> Model:
    if name not in builders:
        raise InvalidInput(f"{kind} {name!r}: unknown; there are {', '.join(sorted(builders))}")
    try:
        return builders[name](**(settings or {}))
    except TypeError as error:
        raise InvalidInput(f"{kind} {name}: {error}") from error
