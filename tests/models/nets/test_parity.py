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
from public_references import c3po, dinov2_queries, rscd_dinov2, rscd_resnet18
from references import cscdnet, tanet
from seeded import filled, seeded_pictures

from reviewer.models.nets.build import NETS, build_net
from reviewer.models.nets.vision_transformer import QueryEncoder

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
    "c3po": ("c3po", {}, partial(c3po, merging="iade")),
    "c3po, id": ("c3po", {"merging": "id"}, partial(c3po, merging="id")),
    "rscd-dinov2": (
        "rscd-dinov2",
        {},
        partial(rscd_dinov2, heads=2, depth=12, side=37, attention_blocks=1, attention_heads=1),
    ),
    "rscd-dinov2, two blocks of two heads": (
        "rscd-dinov2",
        {"depth": 3, "side": 9, "attention_blocks": 2, "attention_heads": 2},
        partial(rscd_dinov2, heads=2, depth=3, side=9, attention_blocks=2, attention_heads=2),
    ),
    "rscd-resnet18": (
        "rscd-resnet18",
        {},
        partial(rscd_resnet18, stage=2, attention_heads=1),
    ),
    "rscd-resnet18, third stage": (
        "rscd-resnet18",
        {"stage": 3, "attention_heads": 2},
        partial(rscd_resnet18, stage=3, attention_heads=2),
    ),
}


def logits(net, pictures):
    with torch.inference_mode():
        return net(pictures)


@pytest.mark.parametrize("case", REFERENCES)
def test_the_forward_pass_equals_its_reference(case):
    name, settings, reference = REFERENCES[case]
    # An RSCD's last ReLU leaves little of what most seeds give.
    net = filled(build_net(name, 0.25, **settings), seed=2 if name.startswith("rscd") else 0)
    pictures = seeded_pictures(*(side // net.multiple * net.multiple for side in (128, 192)))
    wanted = reference(net.state_dict(), pictures)
    assert wanted.std() > 0.1, "logits that hardly vary prove nothing"
    torch.testing.assert_close(logits(net, pictures), wanted, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("case", PUBLIC)
def test_the_logits_are_those_of_the_public_code(case):
    name, settings, _ = REFERENCES[case]
    net = filled(build_net(name, 1.0, **settings))
    found = logits(net, seeded_pictures(64, 128))[0, :, 4::8, 4::8]
    torch.testing.assert_close(found, torch.tensor(PUBLIC[case]), rtol=1e-3, atol=1e-3)


def test_the_queries_are_those_of_another_dinov2():
    """`transformers` has its own code; it does the same at the size that needs no interpolation."""
    from transformers import Dinov2Config, Dinov2Model

    net = filled(QueryEncoder(64, 2, 3, side=4))
    config = Dinov2Config(
        hidden_size=64,
        num_attention_heads=2,
        num_hidden_layers=2,
        image_size=56,
        patch_size=14,
    )
    other = Dinov2Model(config).eval()
    own = net.state_dict()
    theirs = {
        "embeddings.cls_token": own["cls_token"],
        "embeddings.position_embeddings": own["pos_embed"],
        "embeddings.mask_token": torch.zeros(1, 64),
        "embeddings.patch_embeddings.projection.weight": own["patch_embed.proj.weight"],
        "embeddings.patch_embeddings.projection.bias": own["patch_embed.proj.bias"],
        # Its last norm and the queries behind it stand for the beginning of the third block.
        "layernorm.weight": own["blocks.2.norm1.weight"],
        "layernorm.bias": own["blocks.2.norm1.bias"],
    }
    for k in range(2):
        for kind in ("weight", "bias"):
            parts = own[f"blocks.{k}.attn.qkv.{kind}"].chunk(3)
            layer = f"encoder.layer.{k}"
            for letter, part in zip("qkv", parts, strict=True):
                theirs[f"{layer}.attention.{letter}_proj.{kind}"] = part
            theirs[f"{layer}.attention.o_proj.{kind}"] = own[f"blocks.{k}.attn.proj.{kind}"]
            for name in ("norm1", "norm2", "mlp.fc1", "mlp.fc2"):
                theirs[f"{layer}.{name}.{kind}"] = own[f"blocks.{k}.{name}.{kind}"]
        for name in (1, 2):
            theirs[f"{layer}.layer_scale{name}.lambda1"] = own[f"blocks.{k}.ls{name}.gamma"]
    other.load_state_dict(theirs)
    image = seeded_pictures(56, 56)[:, :3]
    with torch.inference_mode():
        state = other(image).last_hidden_state[:, 1:]
        weight = own["blocks.2.attn.qkv.weight"][:64]
        queries = state @ weight.T + own["blocks.2.attn.qkv.bias"][:64]
        found = net(image)
    wanted = torch.nn.functional.normalize(queries, dim=-1).mT.reshape(1, 64, 4, 4)
    torch.testing.assert_close(found, wanted, rtol=1e-4, atol=1e-4)
    again = dinov2_queries({f"backbone.{k}": v for k, v in own.items()}, image, 2, 3, 4)
    torch.testing.assert_close(found, again, rtol=1e-4, atol=1e-4)


def test_every_net_has_a_reference():
    assert {name for name, _, _ in REFERENCES.values()} == set(NETS)


@pytest.mark.parametrize("name", ["dr-tanet", "tanet"])
def test_one_relu_a_stage_is_another_net(name):
    """What early versions of this program computed; their checkpoints still do."""
    pictures = seeded_pictures(64, 64)
    public, early = (filled(build_net(name, 0.25, relu=r)) for r in ("block", "stage"))
    assert (logits(public, pictures) - logits(early, pictures)).abs().max() > 1
