"""Tell which net a public file holds: by keys, shapes, and what it says of its training."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import isqrt
from pathlib import Path
from typing import Any

from reviewer.errors import InvalidInput
from reviewer.models.nets.build import build_net
from reviewer.models.nets.cscdnet import WINDOW
from reviewer.models.nets.files import State, bare_state, read_weights
from reviewer.models.nets.record import NetRecord
from reviewer.models.nets.tanet import DYNAMIC

ABOVE_A_TIE = 0.502
"""RSCD's logits end in a ReLU. Where both are 0 the public code says "unchanged", and p is 0.5,
which is 128 / 255 in the eight bits that are kept."""

SQUARES = ("ChangeSim", "VL_CMU_CD")
"""Data sets whose pictures C-3PO squeezes to a square of `input_size`."""


def identify(state: State, path: Path, told: Mapping[str, Any]) -> NetRecord:
    """Tell net, width and settings.

    Args:
        told: what the file says of its training, see `files.public_arguments`.

    Raises:
        InvalidInput: when they are those of no net here; says what they look like.
    """
    if "enc1_conv1.weight" in state and "dec_conv1.weight" in state:
        channels = state["enc1_conv1.weight"].shape[0]
        seen = state["dec_conv1.weight"].shape[1] - 3 * channels
        if seen in (0, WINDOW):
            return NetRecord("cscdnet" if seen else "cdnet", channels / 64)
    relative = "attention_module.attention_layer{}.rel_h"
    if "encoder1.conv1.weight" in state and relative.format(1) in state:
        width = state["encoder1.conv1.weight"].shape[0] / 64
        sides = tuple(state[relative.format(k)].shape[3] for k in range(1, 5))
        if sides == DYNAMIC:
            return NetRecord("dr-tanet", width, assumed=("refinement",))
        if len(set(sides)) == 1:
            return NetRecord("tanet", width, {"window": sides[0]}, assumed=("refinement",))
    if "backbone.combinefeature.cfs.3.conv.weight" in state and "classifier.4.weight" in state:
        return _c3po(state, path, told)
    attention = "cross_att_1.multi_head_self_attention.in_proj_weight"
    if f"ca0s.0.{attention}" in state:
        return _rscd_dinov2(state, path, told)
    if f"ca.{attention}" in state and "backbone.layers.0.0.weight" in state:
        return _rscd_resnet18(state, told)
    raise InvalidInput(
        f"{path}: not a CSCDNet, CDNet, TANet, DR-TANet, C-3PO or RSCD; looks like"
        f" {describe(state)}"
    )


def _c3po(state: State, path: Path, told: Mapping[str, Any]) -> NetRecord:
    classes = state["classifier.4.weight"].shape[0]
    if classes != 2:
        raise InvalidInput(f"{path}: a C-3PO of {classes} classes, but 2 are needed")
    data, side = str(told.get("train_dataset", "")), int(told.get("input_size", 0))
    merging = told.get("mtf")
    return NetRecord(
        "c3po",
        state["backbone.combinefeature.cfs.0.conv.weight"].shape[0] / 64,
        {"merging": merging} if merging else {},
        preprocessing="imagenet",
        squeeze_px=side if data.startswith(SQUARES) else 0,
        assumed=() if merging else ("merging",),
    )


def _rscd_dinov2(state: State, path: Path, told: Mapping[str, Any]) -> NetRecord:
    facets = {told.get("facet1", "query"), told.get("facet2", "query")}
    if facets != {"query"}:
        raise InvalidInput(
            f"{path}: an RSCD on the {', '.join(sorted(map(str, facets)))} of DINOv2, but only its"
            " queries are known here"
        )
    blocks = {key.split(".")[1] for key in state if key.startswith("ca0s.")}
    last = told.get("layer1")
    return NetRecord(
        "rscd-dinov2",
        state["conv2.weight"].shape[1] / 384,
        {
            "attention_blocks": len(blocks),
            "attention_heads": int(told.get("num-heads", 1)),
            **({} if last is None else {"depth": int(last) + 1}),
        },
        preprocessing="unit",
        threshold=ABOVE_A_TIE,
    )


def _rscd_resnet18(state: State, told: Mapping[str, Any]) -> NetRecord:
    first = state["backbone.layers.0.0.weight"].shape[0]
    doublings = state["conv2.weight"].shape[1] // first
    return NetRecord(
        "rscd-resnet18",
        first / 64,
        {"stage": doublings.bit_length(), "attention_heads": int(told.get("num-heads", 1))},
        preprocessing="unit",
        threshold=ABOVE_A_TIE,
    )


def with_backbone(
    head: State, record: NetRecord, path: Path, backbone: Path | None
) -> tuple[State, NetRecord]:
    """Join the head of an RSCD and the DINOv2 that was frozen under it; return both as one net's.

    Raises:
        NotFound, InvalidInput: when there is none, or it is no DINOv2 that the head fits.
    """
    if backbone is None:
        raise InvalidInput(
            f"{path}: holds the head of an RSCD alone, since its DINOv2 was frozen; join them with"
            f" `reviewer checkpoint {path} --backbone-weights DINOV2.pth --save NEW.pt`"
        )
    weights = bare_state(read_weights(backbone))
    if "pos_embed" not in weights or "blocks.0.attn.qkv.weight" not in weights:
        raise InvalidInput(
            f"{backbone}: not a DINOv2 in its public naming; looks like {describe(weights)}"
        )
    if "register_tokens" in weights:
        raise InvalidInput(f"{backbone}: a DINOv2 with registers, but RSCD has none")
    _, places, hidden = weights["pos_embed"].shape
    if hidden != round(384 * record.width):
        raise InvalidInput(
            f"{backbone}: has {hidden} channels, but the head in {path} has"
            f" {round(384 * record.width)}"
        )
    blocks = {key.split(".")[1] for key in weights if key.startswith("blocks.")}
    known = {"depth": len(blocks), **record.settings, "side": isqrt(places - 1)}
    record = replace(record, settings=known)
    needed = build_net(record.net, record.width, **record.settings).state_dict()
    below = {f"backbone.{key}": value for key, value in weights.items()}
    return {**head, **{key: value for key, value in below.items() if key in needed}}, record


_LOOKS = (
    ("a torchvision or timm ResNet, which goes to --backbone-weights", "layer1.0.conv1.weight"),
    ("a DINOv2, which goes to --backbone-weights", "blocks.0.attn.qkv.weight"),
    ("a SAM", "vision_encoder.patch_embed.projection.weight"),
    ("a SAM in its first naming", "image_encoder.patch_embed.proj.weight"),
    ("a Grounding DINO", "model.backbone.conv_encoder"),
    ("a CSCDNet with other layers", "enc1_conv1.weight"),
    ("a TANet with other layers", "encoder1.conv1.weight"),
    ("a C-3PO with another backbone or head", "backbone.combinefeature."),
)


def describe(state: State) -> str:
    """Say what a state dict looks like, in a few words."""
    for name, key in _LOOKS:
        if any(k.startswith(key) for k in state):
            return name
    if not state:
        return "a file without weights (an optimizer's state, or settings?)"
    return f"{len(state)} tensors, the first is {next(iter(state))!r}"
