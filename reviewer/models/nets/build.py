"""Build a change detection net by name: random weights, any width."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from torch import nn

from reviewer.errors import InvalidInput
from reviewer.models.nets.attention_mask import AttentionMask
from reviewer.models.nets.cscdnet import CscdNet
from reviewer.models.nets.tanet import DYNAMIC, TaNet


def _cscdnet(width: float) -> nn.Module:
    return CscdNet(width)


def _cdnet(width: float) -> nn.Module:
    return CscdNet(width, correlation=False)


def _cscdnet_attention(
    width: float, level: int = 3, strength: float = 0.5, source: str = "descriptor-energy"
) -> nn.Module:
    return CscdNet(width, attention=AttentionMask(level, strength, source))


def _tanet(width: float, window: int = 3) -> nn.Module:
    if window < 1 or window % 2 == 0:
        raise InvalidInput(f"tanet window: must be odd and positive, but is {window}")
    return TaNet(width, windows=(window,) * 4)


def _dr_tanet(width: float) -> nn.Module:
    return TaNet(width, windows=DYNAMIC, refinement=True)


NETS: dict[str, Callable[..., nn.Module]] = {
    "cdnet": _cdnet,
    "cscdnet": _cscdnet,
    "cscdnet-attention": _cscdnet_attention,
    "dr-tanet": _dr_tanet,
    "tanet": _tanet,
}


def build_net(name: str, width: float = 1.0, **settings: Any) -> nn.Module:
    """Return a net with random weights.

    Args:
        width: factor on its channels; 1 is the paper's net.
        settings: `level`, `strength`, `source` of cscdnet-attention; `window` of tanet.

    Raises:
        InvalidInput: for an unknown name or setting, or a value outside its range.
    """
    if name not in NETS:
        raise InvalidInput(f"net {name!r}: unknown; there are {', '.join(NETS)}")
    try:
        return NETS[name](width, **settings)
    except TypeError as error:
        raise InvalidInput(f"net {name}: {error}") from error
