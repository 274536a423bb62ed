"""Alpha-CLIP's branch in a CLIP vision tower: the mask as a fourth channel of the picture.

One more patch convolution, whose output is added to the patch embedding. The public checkpoint
holds the whole tower under OpenAI's names; they are mapped onto those of `transformers`.

Source: Sun et al., "Alpha-CLIP", CVPR 2024.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from reviewer.errors import InvalidInput
from reviewer.masks import Mask

# (mask - 0.5) / 0.26, as Alpha-CLIP normalises its fourth channel.
ON, OFF = 0.5 / 0.26, -0.5 / 0.26

TOP = {
    "class_embedding": "embeddings.class_embedding",
    "positional_embedding": "embeddings.position_embedding.weight",
    "conv1.weight": "embeddings.patch_embedding.weight",
    "conv1_alpha.weight": "embeddings.patch_embedding_alpha.weight",
    # transformers spells it so.
    "ln_pre.weight": "pre_layrnorm.weight",
    "ln_pre.bias": "pre_layrnorm.bias",
    "ln_post.weight": "post_layernorm.weight",
    "ln_post.bias": "post_layernorm.bias",
}
INNER = {
    "ln_1": "layer_norm1",
    "ln_2": "layer_norm2",
    "attn.out_proj": "self_attn.out_proj",
    "mlp.c_fc": "mlp.fc1",
    "mlp.c_proj": "mlp.fc2",
}
BLOCK = re.compile(r"transformer\.resblocks\.(\d+)\.(.+?)[._](weight|bias)")


class AlphaBranch:
    """The added convolution of a vision tower, and the mask it is shown."""

    def __init__(self, tower: Any) -> None:
        """Add the branch; it changes nothing until it has weights and a mask."""
        self._tower = tower
        patches = tower.embeddings.patch_embedding
        branch = nn.Conv2d(1, patches.out_channels, patches.kernel_size, patches.stride, bias=False)
        nn.init.zeros_(branch.weight)
        self._branch = branch.to(patches.weight.device, patches.weight.dtype)
        tower.embeddings.patch_embedding_alpha = self._branch
        self._alpha: Tensor | None = None
        patches.register_forward_hook(self._add)

    def load(self, path: Path, option: str) -> None:
        """Put the weights of a public Alpha-CLIP checkpoint into the tower.

        Raises:
            InvalidInput: when the file cannot be read, or holds another tower.
        """
        try:
            state = torch.load(path, map_location="cpu", weights_only=True)
            named = transformers_names(state)
            dtype = self._branch.weight.dtype
            self._tower.load_state_dict({key: value.to(dtype) for key, value in named.items()})
        except FileNotFoundError as error:
            raise InvalidInput(f"{option}: there is no such file") from error
        except Exception as error:  # torch and pickle raise many unrelated classes here
            reason = " ".join(str(error).split())[:200]
            raise InvalidInput(
                f"{option}: is no Alpha-CLIP checkpoint of this vision tower, {reason}"
            ) from error

    @contextmanager
    def showing(self, alpha: Tensor) -> Iterator[None]:
        """Show a mask, float (N, 1, side, side) of `ON` and `OFF`, to what is computed inside."""
        self._alpha = alpha
        try:
            yield
        finally:
            self._alpha = None

    def _add(self, module: nn.Module, given: tuple[Tensor, ...], output: Tensor) -> Tensor | None:
        del module, given
        if self._alpha is None:
            return None
        added: Tensor = self._branch(self._alpha.to(output.device, output.dtype))
        return output + added


def alpha_of_mask(mask: Mask) -> Tensor:
    """Return what the branch is shown of a mask bool (side, side): float32 (1, 1, side, side)."""
    return torch.from_numpy(np.where(mask, ON, OFF).astype(np.float32))[None, None]


def transformers_names(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Return a vision tower of OpenAI's names under those of `transformers`; `proj` is not used.

    Raises:
        KeyError: for a name that belongs to no vision tower.
    """
    state = {key.removeprefix("module."): value for key, value in state.items()}
    if any(key.startswith("visual.") for key in state):
        state = {k.removeprefix("visual."): v for k, v in state.items() if k.startswith("visual.")}
    found: dict[str, Tensor] = {}
    for key, value in state.items():
        if key == "proj":
            continue
        if key in TOP:
            found[TOP[key]] = value
            continue
        match = BLOCK.fullmatch(key)
        if match is None:
            raise KeyError(key)
        layer, part, kind = match.groups()
        prefix = f"encoder.layers.{layer}"
        if part == "attn.in_proj":
            for name, third in zip("qkv", value.chunk(3), strict=True):
                found[f"{prefix}.self_attn.{name}_proj.{kind}"] = third.clone()
        else:
            found[f"{prefix}.{INNER[part]}.{kind}"] = value
    return found
