"""Build models by name; the error for an unknown name lists the known ones.

Builders import their module when called, so naming a model costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any, TypeVar, get_args

from reviewer.errors import InvalidInput
from reviewer.models.interfaces import Aligner, ClickSegmenter, Detector, Labeller, Segmenter
from reviewer.models.member_settings import wrong_setting
from reviewer.words import NET_NAMES, Reads, TrainedNet

if TYPE_CHECKING:
    from torch import nn

Model = TypeVar("Model")


def _homography(**settings: Any) -> Aligner:
    from reviewer.models.aligners.planes import HomographyAligner

    return HomographyAligner(**settings)


def _dis(**settings: Any) -> Aligner:
    from reviewer.models.aligners.dense import DisAligner

    return DisAligner(**settings)


def _ecc(**settings: Any) -> Aligner:
    from reviewer.models.aligners.planes import EccAligner

    return EccAligner(**settings)


def _loftr(**settings: Any) -> Aligner:
    from reviewer.models.aligners.matches import LoftrAligner

    return LoftrAligner(**settings)


def _pdcnet(**settings: Any) -> Aligner:
    from reviewer.models.aligners.pdcnet import PdcNetAligner

    return PdcNetAligner(**settings)


def _difference(**settings: Any) -> Detector:
    from reviewer.models.detectors.difference import DifferenceDetector

    return DifferenceDetector(**settings)


def _dinov2(**settings: Any) -> Detector:
    from reviewer.models.detectors.dinov2 import Dinov2Detector

    return Dinov2Detector(**settings)


def _siamese_lite(**settings: Any) -> Detector:
    from reviewer.models.detectors.siamese import SiameseLiteDetector

    return SiameseLiteDetector(**settings)


def _net(name: str) -> Callable[..., Detector]:
    def build(**settings: Any) -> Detector:
        from reviewer.models.detectors.net import NetDetector

        if not settings.get("checkpoint"):
            trained = name in get_args(TrainedNet)
            source = "`reviewer train` makes some" if trained else "`models list` names public ones"
            raise InvalidInput(
                f"detector {name}: needs trained weights, --detector {name}:CHECKPOINT;"
                f" {source}, and `difference` needs none"
            )
        settings.pop("net", None)
        return NetDetector(name, **settings)

    return build


def _oversegment(**settings: Any) -> Segmenter:
    from reviewer.models.segmenters.oversegment import OversegmentSegmenter

    return OversegmentSegmenter(**settings)


def _object_net(**settings: Any) -> Segmenter:
    from reviewer.models.segmenters.object_net import ObjectNetSegmenter

    return ObjectNetSegmenter(**settings)


def _grounded_sam(**settings: Any) -> Segmenter:
    from reviewer.models.segmenters.grounded import GroundedSamSegmenter

    return GroundedSamSegmenter(**settings)


def _sam_everything(**settings: Any) -> Segmenter:
    from reviewer.models.segmenters.everything import SamEverythingSegmenter

    return SamEverythingSegmenter(**settings)


def _sam3(**settings: Any) -> Segmenter:
    from reviewer.models.segmenters.sam3 import Sam3Segmenter

    return Sam3Segmenter(**settings)


def _llava(**settings: Any) -> Labeller:
    from reviewer.models.labellers.llava import LlavaLabeller

    return LlavaLabeller(**settings)


def _llava_alpha(**settings: Any) -> Labeller:
    from reviewer.models.labellers.llava import LlavaAlphaLabeller

    return LlavaAlphaLabeller(**settings)


def _none(**settings: Any) -> Labeller:
    from reviewer.models.labellers.plain import NoLabeller

    return NoLabeller(**settings)


def _vocabulary(**settings: Any) -> Labeller:
    from reviewer.models.labellers.plain import VocabularyLabeller

    return VocabularyLabeller(**settings)


def _click_net(path: str) -> ClickSegmenter:
    from reviewer.models.clicks.net_clicks import NetClicks

    return NetClicks.load(path)


def _grabcut(path: str) -> ClickSegmenter:
    from reviewer.models.clicks.grabcut import GrabCutClicks

    if path:
        raise InvalidInput(f"--click grabcut:{path}: grabcut has no weights, so it takes no path")
    return GrabCutClicks()


def _sam(path: str) -> ClickSegmenter:
    from reviewer.models.clicks.sam import SamClicks

    return SamClicks.load("sam", path)


def _sam2(path: str) -> ClickSegmenter:
    from reviewer.models.clicks.sam import DEFAULT_SAM, SamClicks

    return SamClicks.load("sam2", path or DEFAULT_SAM.partition(":")[2])


ALIGNERS: dict[str, Callable[..., Aligner]] = {
    "dis": _dis,
    "ecc": _ecc,
    "homography": _homography,
    "loftr": _loftr,
    "pdcnet": _pdcnet,
}
DETECTORS: dict[str, Callable[..., Detector]] = {
    "difference": _difference,
    "siamese-lite": _siamese_lite,
    "dinov2": _dinov2,
    **{name: _net(name) for name in NET_NAMES},
}
SEGMENTERS: dict[str, Callable[..., Segmenter]] = {
    "grounded-sam": _grounded_sam,
    "object-net": _object_net,
    "oversegment": _oversegment,
    "sam-everything": _sam_everything,
    "sam3": _sam3,
}
# What a segmenter looks at beside the images: the rest may change without a new search.
SEGMENTER_READS: dict[str, frozenset[Reads]] = {
    "grounded-sam": frozenset({"labels"}),
    "object-net": frozenset({"change"}),
    "oversegment": frozenset({"change"}),
    "sam-everything": frozenset(),
    "sam3": frozenset({"labels"}),
}
LABELLERS: dict[str, Callable[..., Labeller]] = {
    "llava": _llava,
    "llava-alpha": _llava_alpha,
    "none": _none,
    "vocabulary": _vocabulary,
}
# Which setting the PATH of NAME:PATH is.
PATH_SETTING: dict[str, str] = {
    "dinov2": "checkpoint",
    "loftr": "checkpoint",
    "pdcnet": "repository",
    "vocabulary": "words",
    "llava": "checkpoint",
    "llava-alpha": "alpha",
    "grounded-sam": "sam",
    "sam-everything": "sam",
    "sam3": "checkpoint",
    "object-net": "checkpoint",
    "siamese-lite": "checkpoint",
    **{name: "checkpoint" for name in NET_NAMES},
}
PATHS = frozenset({"alpha", "checkpoint", "grounding", "repository", "sam"})
"""Settings that say where weights lie; `weights` says which they are."""
CLICK_SEGMENTERS: dict[str, Callable[[str], ClickSegmenter]] = {
    "click-net": _click_net,
    "grabcut": _grabcut,
    "sam": _sam,
    "sam2": _sam2,
}


def build_aligner(name: str, settings: Mapping[str, Any] | None = None) -> Aligner:
    """Return an aligner; raises InvalidInput for an unknown name or setting."""
    return _build("aligner", ALIGNERS, name, settings)


def build_detector(name: str, width: float = 1.0, **settings: Any) -> nn.Module:
    """Return the torch module of a trainable detector, with random weights.

    Args:
        width: factor on its channels; 1 is the paper's net.
        settings: see `nets.build.build_net`.

    Raises:
        InvalidInput: for a name that is no net, or an unknown setting.
    """
    from reviewer.models.nets.build import build_net

    return build_net(name, width, **settings)


def open_detector(name: str, settings: Mapping[str, Any] | None = None) -> Detector:
    """Return a detector that is ready to detect; a net needs the setting `checkpoint`.

    Raises:
        InvalidInput: for an unknown name or setting, or a checkpoint that does not fit.
    """
    return _build("detector", DETECTORS, name, settings)


def build_segmenter(name: str, settings: Mapping[str, Any] | None = None) -> Segmenter:
    """Return a segmenter; raises InvalidInput for an unknown name or setting."""
    return _build("segmenter", SEGMENTERS, name, settings)


def segmenter_reads(name: str) -> frozenset[Reads]:
    """Return what a segmenter reads besides the images; nothing where its output is imported."""
    return SEGMENTER_READS.get(name, frozenset())


def build_labeller(name: str, settings: Mapping[str, Any] | None = None) -> Labeller:
    """Return a labeller; raises InvalidInput for an unknown name or setting."""
    return _build("labeller", LABELLERS, name, settings)


def build_click_segmenter(text: str) -> ClickSegmenter:
    """Return the click segmenter that `NAME` or `NAME:PATH` names; PATH is a directory or hub id.

    Raises:
        InvalidInput: for an unknown name, or a checkpoint that cannot be loaded.
    """
    name, _, path = text.partition(":")
    if name not in CLICK_SEGMENTERS:
        known = ", ".join(CLICK_SEGMENTERS)
        raise InvalidInput(f"--click {text}: there is no {name!r}; there are {known}")
    return CLICK_SEGMENTERS[name](path)


def settings_of(model: Any) -> dict[str, Any]:
    """Return the settings of a model, for the run's record."""
    return {field.name: getattr(model, field.name) for field in fields(model) if field.init}


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
        message = wrong_setting(name, settings or {}) or str(error)
        raise InvalidInput(f"{kind} {name}: {message}") from error
