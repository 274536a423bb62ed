"""The nets compute what the public code computes, not only under the same names.

Two witnesses: the public forward pass written a second time (`references`), and logits that the
public code itself gave for weights and pictures drawn from a seed (`public_logits.json`: every
eighth row and column, from the fifth). Keys and shapes alone have once hidden a missing ReLU.
"""

import json
from functools import partial
from pathlib import Path

import pytest
import torch
from references import cscdnet, tanet
from seeded import filled, seeded_pictures

from reviewer.models.nets.build import NETS, build_net

PUBLIC = json.loads((Path(__file__).parent / "public_logits.json").read_text())
DYNAMIC = (7, 5, 3, 1)


def descriptor_energy_mask(level, features, image, at=3, strength=0.5):
    """The Siamese attention mask as its page describes it, on the third level of six."""
    if level != at:
        return features
    energy = features.square().sum(1, keepdim=True).sqrt()
    most = energy.flatten(1).quantile(0.95, dim=1)[:, None, None, None]
    return features * (strength * (energy / most).clamp(0, 1) + (1 - strength))


REFERENCES = {
    "cdnet": ("cdnet", {}, partial(cscdnet, correlation=False)),
    "cscdnet": ("cscdnet", {}, partial(cscdnet, correlation=True)),
    "cscdnet-attention": (
        "cscdnet-attention",
        {},
        partial(cscdnet, correlation=True, damp=descriptor_energy_mask),
    ),
    "dr-tanet": ("dr-tanet", {}, partial(tanet, sides=DYNAMIC, refinement=True)),
    "dr-tanet, no refinement": (
        "dr-tanet",
        {"refinement": False},
        partial(tanet, sides=DYNAMIC, refinement=False),
    ),
    "tanet, window 3": ("tanet", {}, partial(tanet, sides=(3,) * 4, refinement=False)),
    "tanet, window 3, refinement": (
        "tanet",
        {"refinement": True},
        partial(tanet, sides=(3,) * 4, refinement=True),
    ),
    "tanet, window 5": ("tanet", {"window": 5}, partial(tanet, sides=(5,) * 4, refinement=False)),
}


def logits(net, pictures):
    with torch.inference_mode():
        return net(pictures)


@pytest.mark.parametrize("case", REFERENCES)
def test_the_forward_pass_equals_its_reference(case):
    name, settings, reference = REFERENCES[case]
    net = filled(build_net(name, 0.25, **settings))
    pictures = seeded_pictures(128, 192)
    wanted = reference(net.state_dict(), pictures)
    assert wanted.std() > 0.1, "logits that hardly vary prove nothing"
    torch.testing.assert_close(logits(net, pictures), wanted, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("case", PUBLIC)
def test_the_logits_are_those_of_the_public_code(case):
    name, settings, _ = REFERENCES[case]
    net = filled(build_net(name, 1.0, **settings))
    found = logits(net, seeded_pictures(64, 128))[0, :, 4::8, 4::8]
    torch.testing.assert_close(found, torch.tensor(PUBLIC[case]), rtol=1e-3, atol=1e-3)


def test_every_net_has_a_reference():
    assert {name for name, _, _ in REFERENCES.values()} == set(NETS)


@pytest.mark.parametrize("name", ["dr-tanet", "tanet"])
def test_one_relu_a_stage_is_another_net(name):
    """What early versions of this program computed; their checkpoints still do."""
    pictures = seeded_pictures(64, 64)
    public, early = (filled(build_net(name, 0.25, relu=r)) for r in ("block", "stage"))
    assert (logits(public, pictures) - logits(early, pictures)).abs().max() > 1
