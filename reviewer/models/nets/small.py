"""The small nets' weights: safetensors files, half precision, with what made them in the header.

Two lie in the package, so that everything works without a download. `docs/small-nets.md` is their
model card.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import nn

from reviewer.atomic import whole_file
from reviewer.errors import InvalidInput, NotFound

SHIPPED = Path(__file__).parent / "shipped"


def small_weights(name: str, given: str = "") -> Path:
    """Return the file of a small net: the one given, else the one in the package."""
    return Path(given) if given else SHIPPED / f"{name}.safetensors"


def save_small(path: Path, net: nn.Module, name: str, about: Mapping[str, str]) -> None:
    """Write weights in half precision, with the net's name and what made them.

    The same weights give the same bytes; the file is written whole or not at all.
    """
    state = {
        key: value.half().contiguous() if value.is_floating_point() else value
        for key, value in net.state_dict().items()
    }
    content = save(state, {"net": name, **about})
    (size,) = struct.unpack("<Q", content[:8])
    # What made them is laid out in an order that differs from run to run; tensors are not.
    header = json.dumps(json.loads(content[8 : 8 + size]), sort_keys=True, separators=(",", ":"))
    header += " " * (-len(header) % 8)
    with whole_file(path) as file:
        file.write(struct.pack("<Q", len(header)) + header.encode() + content[8 + size :])


def channels_last(net: nn.Module) -> None:
    """Lay a net's weights out as its convolutions are fastest on a processor."""
    for parameter in net.parameters():
        if parameter.dim() == 4:
            parameter.data = parameter.data.contiguous(memory_format=torch.channels_last)


def load_small(path: Path, net: nn.Module, name: str) -> dict[str, str]:
    """Fill a net with the weights of a file, ready to be used; return the file's header.

    Raises:
        NotFound: when the file does not exist.
        InvalidInput: when it is no safetensors file, or of another net.
    """
    if not path.is_file():
        raise NotFound(f"{path}: weights of {name} do not exist")
    try:
        with safe_open(path, "pt") as file:
            about = dict(file.metadata() or {})
            state = {key: file.get_tensor(key) for key in file.keys()}
    except SafetensorError as error:
        raise InvalidInput(f"{path}: is no safetensors file, {error}") from error
    if about.get("net") != name:
        raise InvalidInput(f"{path}: holds weights of {about.get('net')!r}, but {name} is wanted")
    try:
        net.load_state_dict(
            {k: v.float() if v.is_floating_point() else v for k, v in state.items()}
        )
    except RuntimeError as error:
        reason = " ".join(str(error).split())[:200]
        raise InvalidInput(f"{path}: does not fit {name}, {reason}") from error
    net.eval()
    channels_last(net)
    return about
