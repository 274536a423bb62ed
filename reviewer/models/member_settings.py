"""The settings of a member: names, defaults, and descriptions from its docstring.

The classes' fields are the settings; here they are found without building a model, for the message
about a wrong one and for docs/settings.md.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from importlib import import_module
from typing import Any

NET = "reviewer.models.detectors.net:NetDetector"
CLASSES: Mapping[str, Mapping[str, str]] = {
    "align": {
        "dis": "reviewer.models.aligners.dense:DisAligner",
        "ecc": "reviewer.models.aligners.planes:EccAligner",
        "homography": "reviewer.models.aligners.planes:HomographyAligner",
        "loftr": "reviewer.models.aligners.matches:LoftrAligner",
        "pdcnet": "reviewer.models.aligners.pdcnet:PdcNetAligner",
    },
    "detect": {
        "difference": "reviewer.models.detectors.difference:DifferenceDetector",
        "dinov2": "reviewer.models.detectors.dinov2:Dinov2Detector",
        "c3po": NET,
        "cdnet": NET,
        "cscdnet": NET,
        "cscdnet-attention": NET,
        "dr-tanet": NET,
        "rscd-dinov2": NET,
        "rscd-resnet18": NET,
        "siamese-lite": "reviewer.models.detectors.siamese:SiameseLiteDetector",
        "tanet": NET,
    },
    "label": {
        "llava": "reviewer.models.labellers.llava:LlavaLabeller",
        "llava-alpha": "reviewer.models.labellers.llava:LlavaAlphaLabeller",
        "none": "reviewer.models.labellers.plain:NoLabeller",
        "vocabulary": "reviewer.models.labellers.plain:VocabularyLabeller",
    },
    "search": {
        "grounded-sam": "reviewer.models.segmenters.grounded:GroundedSamSegmenter",
        "object-net": "reviewer.models.segmenters.object_net:ObjectNetSegmenter",
        "oversegment": "reviewer.models.segmenters.oversegment:OversegmentSegmenter",
        "sam-everything": "reviewer.models.segmenters.everything:SamEverythingSegmenter",
        "sam3": "reviewer.models.segmenters.sam3:Sam3Segmenter",
    },
}
"""Classes by stage and registry name; tests hold this and the registry together."""


@dataclass(frozen=True, slots=True)
class Setting:
    """One setting: its default as Python writes it ("" = it must be given), and what it does."""

    name: str
    default: str
    about: str


def member_settings(stage: str, name: str) -> list[Setting]:
    """Return the settings of a member, in the order of its fields."""
    module, _, title = CLASSES[stage][name].partition(":")
    return describe_settings(getattr(import_module(module), title))


def wrong_setting(name: str, given: Mapping[str, Any]) -> str:
    """Return what is wrong with the names of given settings, "" if nothing is."""
    stage = next((stage for stage, members in CLASSES.items() if name in members), None)
    known = [setting.name for setting in member_settings(stage, name)] if stage else []
    unknown = next((each for each in given if each not in known), None) if stage else None
    if unknown is None:
        return ""
    return f"has no setting {unknown!r}; it has {', '.join(known) or 'none'} (docs/settings.md)"


def describe_settings(settings: type[Any]) -> list[Setting]:
    """Return the fields of a dataclass with what `Attributes:` says of each, its parents' too."""
    about: dict[str, str] = {}
    for each in reversed(settings.__mro__):
        about.update(_attributes(inspect.cleandoc(each.__dict__.get("__doc__") or "")))
    found = []
    for field in fields(settings):
        if not field.init or field.name == "net":  # the registry fills that in
            continue
        default: Any = field.default
        if field.default_factory is not MISSING:
            default = field.default_factory()
        shown = "" if default is MISSING else repr(default)
        found.append(Setting(field.name, shown, about.get(field.name, "")))
    return found


def _attributes(text: str) -> dict[str, str]:
    """Read the entries of a docstring's `Attributes:`; one entry may name several fields."""
    _, head, rest = text.partition("Attributes:\n")
    found: dict[str, str] = {}
    section = re.match(r"(?:(?:    .*)?\n?)*", rest) if head else None
    entries = re.split(r"^    (?=\S)", section[0] if section else "", flags=re.MULTILINE)
    for entry in entries:
        names, colon, words = entry.partition(":")
        if colon:
            for name in names.split(","):
                found[name.strip()] = " ".join(words.split())
    return found
