"""Build a change detection net by name: random weights, any width."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

from torch import nn

from reviewer.errors import InvalidInput
from reviewer.models.nets.attention_mask import AttentionMask
from reviewer.models.nets.c3po import C3po
from reviewer.models.nets.cscdnet import CscdNet
from reviewer.models.nets.rscd import RscdDino, RscdResNet
from reviewer.models.nets.tanet import DYNAMIC, TaNet
from reviewer.words import MERGINGS, RELUS, Merging, Relu


def _cscdnet(width: float) -> nn.Module:
    return CscdNet(width)


def _cdnet(width: float) -> nn.Module:
    return CscdNet(width, correlation=False)


def _cscdnet_attention(
    width: float, level: int = 3, strength: float = 0.5, source: str = "descriptor-energy"
) -> nn.Module:
    return CscdNet(width, attention=AttentionMask(level, strength, source))


def _tanet(
    width: float, window: int = 3, refinement: bool = False, relu: Relu = "block"
) -> nn.Module:
    if window < 1 or window % 2 == 0:
        raise InvalidInput(f"tanet window: must be odd and positive, but is {window}")
    return TaNet(width, windows=(window,) * 4, refinement=refinement, relu=_relu(relu))


def _dr_tanet(width: float, refinement: bool = True, relu: Relu = "block") -> nn.Module:
    return TaNet(width, windows=DYNAMIC, refinement=refinement, relu=_relu(relu))


def _relu(name: Relu) -> Relu:
    if name not in RELUS:
        raise InvalidInput(f"net relu {name!r}: there are block, stage")
    return name


def _c3po(width: float, merging: Merging = "iade") -> nn.Module:
    if merging not in MERGINGS:
        raise InvalidInput(f"net merging {merging!r}: there are {', '.join(MERGINGS)}")
    return C3po(width, merging=merging)


def _rscd_dinov2(
    width: float,
    depth: int = 12,
    side: int = 37,
    attention_blocks: int = 1,
    attention_heads: int = 1,
) -> nn.Module:
    return RscdDino(
        width,
        depth=depth,
        side=side,
        attention_blocks=attention_blocks,
        attention_heads=attention_heads,
    )


def _rscd_resnet18(width: float, stage: int = 2, attention_heads: int = 1) -> nn.Module:
    return RscdResNet(width, stage=stage, attention_heads=attention_heads)


UNTOLD = ("attention_heads", "merging", "refinement", "relu")
"""Settings that cannot be read from a file's keys and shapes."""

NETS: dict[str, Callable[..., nn.Module]] = {
    "c3po": _c3po,
    "cdnet": _cdnet,
    "cscdnet": _cscdnet,
    "cscdnet-attention": _cscdnet_attention,
    "dr-tanet": _dr_tanet,
    "rscd-dinov2": _rscd_dinov2,
    "rscd-resnet18": _rscd_resnet18,
    "tanet": _tanet,
}


def full_settings(name: str, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of a net with its defaults written out, as every record has them."""
    parameters = inspect.signature(NETS[name]).parameters.values() if name in NETS else ()
    defaults = {p.name: p.default for p in parameters if p.default is not p.empty}
    return {**defaults, **settings}


def untold_settings(name: str) -> dict[str, Any]:
    """Return the defaults of those settings that cannot be read from a file's keys and shapes."""
    return {k: v for k, v in full_settings(name, {}).items() if k in UNTOLD}


def settings_of_record(name: str, recorded: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of a record, which an early version of this program may have written.

    It wrote none of `refinement` and `relu`, and had one ReLU a stage (see `TaNet`).
    """
    untold = untold_settings(name)
    return {**untold, **({"relu": "stage"} if "relu" in untold else {}), **recorded}


def build_net(name: str, width: float = 1.0, **settings: Any) -> nn.Module:
    """Return a net with random weights.

    Args:
        width: factor on its channels; 1 is the paper's net.
        settings: `level`, `strength`, `source` of cscdnet-attention; `window` of tanet;
            `refinement` and `relu` of tanet and dr-tanet; `merging` of c3po; `depth`, `side`,
            `attention_blocks` of rscd-dinov2, `stage` of rscd-resnet18, and `attention_heads` of
            both.

    Raises:
        InvalidInput: for an unknown name or setting, or a value outside its range.
    """
    if name not in NETS:
        raise InvalidInput(f"net {name!r}: unknown; there are {', '.join(NETS)}")
    try:
        return NETS[name](width, **settings)
    except TypeError as error:
        raise InvalidInput(f"net {name}: {error}") from error
