"""Checkpoints of change detection nets: ours, with their record, and the public ones, bare.

A checkpoint of ours is one file with the weights and a record of all that a run needs to use them:
which net, its width and settings, preprocessing, batch-norm mode, threshold, polarity, and how it
was trained. A bare state dict (sscdnet, DR-TANet, with or without `module.`) is told by its keys
and shapes. Nothing is unpickled but tensors and plain values.
"""

from __future__ import annotations

import pickle
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from reviewer.atomic import whole_file
from reviewer.errors import InvalidInput, NotFound
from reviewer.models.nets.build import (
    build_net,
    full_settings,
    settings_of_record,
    untold_settings,
)
from reviewer.models.nets.cscdnet import WINDOW
from reviewer.models.nets.tanet import DYNAMIC
from reviewer.words import BATCH_NORM_MODES, PREPROCESSINGS, BatchNormMode, Preprocessing

State = dict[str, Tensor]

FORMAT = "reviewer-checkpoint"


@dataclass(frozen=True, slots=True)
class NetRecord:
    """The record of a net's weights.

    Attributes:
        net, width, settings: see `build_net`; of TANet and DR-TANet `refinement` and `relu` too,
            which no key tells.
        preprocessing: see `pictures.prepare`.
        bn_mode: "eval" uses the statistics of training; "batch" those of the pair at hand, as the
            public CSCDNet test code does.
        threshold: a pixel is changed where its probability exceeds this.
        changed_class: which of the two logits speaks for change (polarity).
        window_px: side of the windows in which pictures are shown to the net; 0 = whole, as the
            public codes do.
        training: settings, seed, data hash and scores of the training; empty for public ones.
        assumed: settings that a bare file does not tell and nobody has given.
    """

    net: str
    width: float = 1.0
    settings: Mapping[str, Any] = field(default_factory=dict)
    preprocessing: Preprocessing = "bgr_128"
    bn_mode: BatchNormMode = "eval"
    threshold: float = 0.5
    changed_class: int = 1
    window_px: int = 0
    training: Mapping[str, Any] = field(default_factory=dict)
    assumed: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "settings", {**untold_settings(self.net), **self.settings})
        if self.preprocessing not in PREPROCESSINGS:
            known = ", ".join(PREPROCESSINGS)
            raise InvalidInput(f"preprocessing {self.preprocessing!r}: there are {known}")
        if self.bn_mode not in BATCH_NORM_MODES:
            raise InvalidInput(f"bn_mode {self.bn_mode!r}: there are eval, batch")
        if not 0 <= self.threshold < 1:
            raise InvalidInput(f"threshold: must lie in [0, 1), but is {self.threshold}")
        if self.window_px < 0 or self.window_px % 64:
            raise InvalidInput(f"window_px: 0 or a multiple of 64, but is {self.window_px}")
        if self.changed_class not in (0, 1):
            raise InvalidInput(f"changed_class: must be 0 or 1, but is {self.changed_class}")

    def arithmetic(self) -> dict[str, Any]:
        """Return what determines the probabilities of a pair besides the weights.

        Only what differs from a net's defaults as early versions had them: the keys of their
        results stay what they are.
        """
        early = {**full_settings(self.net, {}), "preprocessing": "bgr_128", "changed_class": 1}
        if "relu" in early:
            early["relu"] = "stage"
        own = {
            **self.settings,
            "preprocessing": self.preprocessing,
            "changed_class": self.changed_class,
        }
        return {name: value for name, value in own.items() if value != early.get(name)}


def save_checkpoint(path: Path, net: nn.Module, record: NetRecord) -> None:
    """Replace a file by weights and record, completely or not at all.

    Raises:
        OSError: when it cannot be written (disk full); the earlier file stays.
    """
    state = {key: value.detach().cpu() for key, value in net.state_dict().items()}
    save_whole(path, {"format": FORMAT, "record": asdict(record), "state": state})


def save_whole(path: Path, content: Mapping[str, Any]) -> None:
    """`torch.save` that leaves the earlier file in place when it fails.

    Raises:
        OSError: when it cannot be written.
    """
    with whole_file(path) as file:
        try:
            torch.save(dict(content), file)
        except RuntimeError as error:  # torch's zip writer hides the reason of a failed write
            raise OSError(f"{path}: could not be written, {error}") from error


def load_checkpoint(path: Path, expected: str | None = None) -> tuple[nn.Module, NetRecord]:
    """Return a net with the weights of a checkpoint, and its record.

    Args:
        expected: the net that the caller wants; it also settles what keys cannot tell
            (cscdnet or cscdnet-attention).

    Raises:
        NotFound: when there is no such file.
        InvalidInput: when the file is not a checkpoint of a net known here, or of another than
            expected; the message says what it looks like instead.
    """
    try:
        return _load(path, expected)
    except InvalidInput as error:
        if str(path) in str(error):
            raise
        raise InvalidInput(f"{path}: {error}") from error
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
        raise InvalidInput(f"{path}: a damaged checkpoint, {error!r}") from error


def _load(path: Path, expected: str | None) -> tuple[nn.Module, NetRecord]:
    content = read_weights(path)
    if content.get("format") == FORMAT:
        known = {f.name for f in fields(NetRecord)}
        unknown = sorted(set(content["record"]) - known)
        if unknown:
            raise InvalidInput(f"{path}: record has {', '.join(unknown)}, unknown to this version")
        recorded, state = dict(content["record"]), content["state"]
        recorded["settings"] = settings_of_record(recorded["net"], recorded["settings"])
        record = NetRecord(**recorded)
    else:
        state = bare_state(content)
        record = identify(state, path)
    if expected is not None and record.net != expected:
        if {record.net, expected} != {"cscdnet", "cscdnet-attention"}:
            raise InvalidInput(
                f"{path}: is a {record.net} (width {record.width:g}), not {expected}"
            )
        record = replace(record, net=expected, settings={})
    net = build_net(record.net, record.width, **record.settings)
    fill(net, state, f"{path}: does not fit {record.net} of width {record.width:g}")
    return net, record


def read_weights(path: Path) -> dict[str, Any]:
    """Return what a .pt, .pth or .safetensors file holds; only tensors and plain values.

    Raises:
        NotFound, InvalidInput: when it is missing, or no such file.
    """
    if not path.is_file():
        raise NotFound(f"{path}: no such checkpoint file")
    try:
        if path.suffix == ".safetensors":
            from safetensors.torch import load_file

            return dict(load_file(path))
        content = torch.load(path, map_location="cpu", weights_only=True)
    except pickle.UnpicklingError as error:
        raise InvalidInput(
            f"{path}: holds Python objects, not only weights (a whole pickled model?);"
            " save its state_dict() instead"
        ) from error
    except Exception as error:  # torch, zip and safetensors readers raise what they like
        reason = (str(error).splitlines() or ["it is cut off"])[0]
        raise InvalidInput(f"{path}: not a checkpoint, {reason}") from error
    if not isinstance(content, dict):
        raise InvalidInput(f"{path}: holds a {type(content).__name__}, not a dict of weights")
    return content


def bare_state(content: Mapping[str, Any]) -> State:
    """Return the state dict, unwrapped from `state_dict` or `model`, without `module.`."""
    for wrapper in ("state_dict", "model"):
        inner = content.get(wrapper)
        if isinstance(inner, Mapping):
            content = inner
    return {k.removeprefix("module."): v for k, v in content.items() if isinstance(v, Tensor)}


def identify(state: State, path: Path) -> NetRecord:
    """Tell net and width by keys and shapes.

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
    raise InvalidInput(
        f"{path}: not a CSCDNet, CDNet, TANet or DR-TANet; looks like {describe(state)}"
    )


_LOOKS = (
    ("a torchvision or timm ResNet, which goes to --backbone-weights", "layer1.0.conv1.weight"),
    ("a SAM", "vision_encoder.patch_embed.projection.weight"),
    ("a SAM in its first naming", "image_encoder.patch_embed.proj.weight"),
    ("a Grounding DINO", "model.backbone.conv_encoder"),
    ("a CSCDNet with other layers", "enc1_conv1.weight"),
    ("a TANet with other layers", "encoder1.conv1.weight"),
)


def describe(state: State) -> str:
    """Say what a state dict looks like, in a few words."""
    for name, key in _LOOKS:
        if any(k.startswith(key) for k in state):
            return name
    if not state:
        return "a file without weights (an optimizer's state, or settings?)"
    return f"{len(state)} tensors, the first is {next(iter(state))!r}"


def fill(net: nn.Module, state: State, trouble: str) -> None:
    """Load weights strictly.

    Raises:
        InvalidInput: with `trouble` and the first difference, or where weights are not finite.
    """
    own = net.state_dict()
    for key, value in state.items():
        if key in own and own[key].shape != value.shape:
            raise InvalidInput(
                f"{trouble}: {key} is {tuple(value.shape)}, but should be {tuple(own[key].shape)}"
            )
        if value.is_floating_point() and not torch.isfinite(value).all():
            raise InvalidInput(f"{trouble}: {key} has values that are not finite")
    try:
        net.load_state_dict(state, strict=True)
    except RuntimeError as error:
        reason = re.sub(r"\s+", " ", str(error).partition("\n")[2])[:300]
        raise InvalidInput(f"{trouble}: {reason}") from error
