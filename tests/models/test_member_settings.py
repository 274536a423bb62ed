"""What can be set of a member is what its class takes and its docstring explains."""

import pytest

from reviewer.errors import InvalidInput
from reviewer.models.member_settings import CLASSES, describe_settings, member_settings
from reviewer.models.registry import (
    ALIGNERS,
    DETECTORS,
    LABELLERS,
    SEGMENTERS,
    build_aligner,
    build_labeller,
    build_segmenter,
    open_detector,
)
from reviewer.synthesis.settings import SynthesisSettings

REGISTRY = {"align": ALIGNERS, "detect": DETECTORS, "label": LABELLERS, "search": SEGMENTERS}
MEMBERS = [(stage, name) for stage, members in CLASSES.items() for name in members]


def test_every_member_of_the_registry_tells_its_settings():
    assert {stage: set(names) for stage, names in CLASSES.items()} == {
        stage: set(names) for stage, names in REGISTRY.items()
    }


@pytest.mark.parametrize(("stage", "name"), MEMBERS)
def test_every_setting_says_what_it_does(stage, name):
    assert [setting.name for setting in member_settings(stage, name) if not setting.about] == []


def test_the_settings_of_synthesis_are_explained_too():
    settings = {setting.name: setting for setting in describe_settings(SynthesisSettings)}
    assert all(setting.about for setting in settings.values())
    assert (settings["removal"].default, settings["size_px"].default) == ("0.3", "(6.0, 120.0)")


@pytest.mark.parametrize(
    ("build", "name", "valid"),
    [
        (build_aligner, "dis", "disagreement_px, reach_px"),
        (open_detector, "difference", "tolerance_px, light_px, steepness, middle, least_distance"),
        (
            open_detector,
            "cscdnet",
            "checkpoint, weights, arithmetic, bn_mode, window, precision, batch",
        ),
        (build_segmenter, "oversegment", "scale, sigma, least_px"),
    ],
)
def test_a_wrong_setting_names_the_valid_ones(build, name, valid):
    with pytest.raises(InvalidInput, match=f"{name}: has no setting 'nothing'; it has {valid}"):
        build(
            name, {"nothing": 3, "checkpoint": "none.pt"} if name == "cscdnet" else {"nothing": 3}
        )


def test_a_member_without_settings_says_so():
    with pytest.raises(InvalidInput, match="labeller none: has no setting 'words'; it has none"):
        build_labeller("none", {"words": {}})
