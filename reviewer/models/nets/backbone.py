"""Start the encoders from a ResNet-18 trained on ImageNet: torchvision's or timm's file.

Both name their layers alike; the classifier is left out. The file is given, never downloaded.
"""

from __future__ import annotations

from pathlib import Path

import torch
from torch import nn

from reviewer.errors import InvalidInput
from reviewer.models.nets.cscdnet import CscdNet
from reviewer.models.nets.files import State, bare_state, read_weights
from reviewer.models.nets.recognising import describe


def load_backbone(net: nn.Module, path: Path) -> int:
    """Fill both encoders with the weights of a ResNet-18 file; return how many tensors it gave.

    Raises:
        NotFound, InvalidInput: when the file is missing, no ResNet-18, or of another width.
    """
    state = bare_state(read_weights(path))
    body = {k: v for k, v in state.items() if not k.startswith(("fc.", "classifier."))}
    if "conv1.weight" not in body or "layer4.1.conv2.weight" not in body:
        raise InvalidInput(
            f"{path}: not a ResNet-18 in torchvision or timm naming; looks like {describe(state)}"
        )
    if "layer1.2.conv1.weight" in body or "layer1.0.conv3.weight" in body:
        raise InvalidInput(f"{path}: a deeper ResNet than 18 (it has layers ResNet-18 has not)")
    encoder = _cscdnet_names if isinstance(net, CscdNet) else _tanet_names
    own = net.state_dict()
    given: State = {}
    for key, value in body.items():
        for number in (1, 2):
            name = encoder(key, number)
            if name not in own:
                raise InvalidInput(f"{path}: {key} has no place in a ResNet-18 encoder")
            if own[name].shape != value.shape:
                raise InvalidInput(
                    f"{path}: {key} is {tuple(value.shape)}, but this net has"
                    f" {tuple(own[name].shape)}; a backbone fits a net of width 1"
                )
            given[name] = value
    with torch.no_grad():
        for name, value in given.items():
            own[name].copy_(value)
    return len(given)


def _tanet_names(key: str, number: int) -> str:
    return f"encoder{number}.{key}"


def _cscdnet_names(key: str, number: int) -> str:
    """layer3.0.conv1.weight -> enc1_res3_1.conv1.weight; conv1.weight -> enc1_conv1.weight."""
    first, _, rest = key.partition(".")
    if not first.startswith("layer"):
        return f"enc{number}_{key}"
    block, _, rest = rest.partition(".")
    return f"enc{number}_res{first.removeprefix('layer')}_{int(block) + 1}.{rest}"
