"""Checkpoints of change detection nets: ours, with their record, and the public ones, bare.

A checkpoint of ours is one file with the weights and a record of all that a run needs to use them:
which net, its width and settings, preprocessing, batch-norm mode, threshold, polarity, and how it
was trained. A public file is recognised (`recognising`), and its weights fit without translation.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import torch
from torch import nn

from reviewer.atomic import whole_file
from reviewer.errors import InvalidInput
from reviewer.models.nets.build import build_net, settings_of_record
from reviewer.models.nets.files import State, bare_state, public_arguments, read_weights
from reviewer.models.nets.recognising import identify, with_backbone
from reviewer.models.nets.record import NetRecord

FORMAT = "reviewer-checkpoint"


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


def load_checkpoint(
    path: Path, expected: str | None = None, backbone: Path | None = None
) -> tuple[nn.Module, NetRecord]:
    """Return a net with the weights of a checkpoint, and its record.

    Args:
        expected: the net that the caller wants; it also settles what keys cannot tell
            (cscdnet or cscdnet-attention).
        backbone: weights of a frozen backbone, which a public file may have left out.

    Raises:
        NotFound: when there is no such file.
        InvalidInput: when the file is not a checkpoint of a net known here, or of another than
            expected; the message says what it looks like instead.
    """
    try:
        return _load(path, expected, backbone)
    except InvalidInput as error:
        if str(path) in str(error):
            raise
        raise InvalidInput(f"{path}: {error}") from error
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
        raise InvalidInput(f"{path}: a damaged checkpoint, {error!r}") from error


def _load(path: Path, expected: str | None, backbone: Path | None) -> tuple[nn.Module, NetRecord]:
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
        record = identify(state, path, public_arguments(content))
        if record.net == "rscd-dinov2":
            state, record = with_backbone(state, record, path, backbone)
    if expected is not None and record.net != expected:
        if {record.net, expected} != {"cscdnet", "cscdnet-attention"}:
            raise InvalidInput(
                f"{path}: is a {record.net} (width {record.width:g}), not {expected}"
            )
        record = replace(record, net=expected, settings={})
    net = build_net(record.net, record.width, **record.settings)
    fill(net, state, f"{path}: does not fit {record.net} of width {record.width:g}")
    return net, record


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
