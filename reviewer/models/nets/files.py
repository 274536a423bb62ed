"""Read weights files: tensors and plain values, nothing else is unpickled.

Public trainings leave their command line (an `argparse.Namespace`) and scores (numpy scalars) in
their files. These are let in by name, since they can hold data and do nothing.
"""

from __future__ import annotations

import argparse
import pickle
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from reviewer.errors import InvalidInput, NotFound

State = dict[str, Tensor]

_SCALAR = np.float64(0).__reduce__()[0]
_HARMLESS: list[Any] = [
    argparse.Namespace,
    np.dtype,
    _SCALAR,
    (_SCALAR, "numpy.core.multiarray.scalar"),  # as numpy before 2.0 names it
    *(type(np.dtype(kind)) for kind in ("bool", "int32", "int64", "float32", "float64")),
]


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
        with torch.serialization.safe_globals(_HARMLESS):
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


def public_arguments(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a public file says of its training: the command line of C-3PO, the model's part
    of RSCD's settings; nothing where it is silent."""
    told = content.get("args")
    if isinstance(told, argparse.Namespace):
        return vars(told)
    model = told.get("model") if isinstance(told, Mapping) else None
    return dict(model) if isinstance(model, Mapping) else {}
