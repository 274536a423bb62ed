"""EfficientNet-Lite0's features: as TensorFlow pads them, and as the public port gives them."""

import pytest
import torch
from efficientnet_lite_pytorch import EfficientNet
from torch.nn import functional

from reviewer.models.nets.lite0 import LEVEL_CHANNELS, LEVELS, Lite0Features, SameConv
from reviewer.models.nets.siamese_lite import SiameseLite


def randomised(net):
    """Give a net weights and batch statistics of its own, the same ones every time."""
    torch.manual_seed(1)
    with torch.no_grad():
        for name, value in net.state_dict().items():
            if name.endswith("running_var"):
                value.uniform_(0.5, 1.5)
            elif name.endswith("running_mean"):
                value.normal_(0, 0.1)
            elif value.dim() == 4:
                value.normal_(0, (2 / value[0].numel()) ** 0.5)
            elif value.is_floating_point():
                value.uniform_(0.5, 1.5)
    return net.eval()


def same(x, weight, stride, groups=1):
    """TensorFlow's "SAME", written down by its definition: the output has ceil(n / s) places."""
    kernel = weight.shape[-1]
    height, width = x.shape[-2:]
    rows, columns = -(-height // stride), -(-width // stride)
    down = max((rows - 1) * stride + kernel - height, 0)
    across = max((columns - 1) * stride + kernel - width, 0)
    wide = torch.zeros(*x.shape[:2], height + down, width + across)
    wide[..., down // 2 : down // 2 + height, across // 2 : across // 2 + width] = x
    return functional.conv2d(wide, weight, stride=stride, groups=groups)


def transcribed(state, pictures):
    """The network as its paper's tables have it, from the weights alone."""

    def norm(x, key):
        mean, variance = state[f"{key}.running_mean"], state[f"{key}.running_var"]
        scaled = (x - mean[:, None, None]) / (variance[:, None, None] + 1e-3).sqrt()
        return scaled * state[f"{key}.weight"][:, None, None] + state[f"{key}.bias"][:, None, None]

    stages = [  # repeats, kernel, first stride, widens
        (1, 3, 1, False), (2, 3, 2, True), (2, 5, 2, True), (3, 3, 2, True), (3, 5, 1, True),
    ]  # fmt: skip
    x = (pictures - 127) / 128
    x = norm(same(x, state["_conv_stem.weight"], 2), "_bn0").clamp(0, 6)
    number, levels = 0, []
    for repeats, _, first, widens in stages:
        for k in range(repeats):
            at, y = f"_blocks.{number}", x
            if widens:
                expanded = same(y, state[f"{at}._expand_conv.weight"], 1)
                y = norm(expanded, f"{at}._bn0").clamp(0, 6)
            depthwise = state[f"{at}._depthwise_conv.weight"]
            stride = first if k == 0 else 1
            y = norm(same(y, depthwise, stride, len(depthwise)), f"{at}._bn1").clamp(0, 6)
            y = norm(same(y, state[f"{at}._project_conv.weight"], 1), f"{at}._bn2")
            x = x + y if k else y
            number += 1
            levels.append(x)
    return [levels[k] for k in LEVELS]


SIZES = [(64, 96), (65, 97), (50, 33), (31, 224)]


@pytest.mark.parametrize("size", SIZES)
def test_features_are_those_of_a_transcription_on_even_and_odd_sizes(size):
    net = randomised(Lite0Features())
    pictures = torch.rand(2, 3, *size, generator=torch.manual_seed(0)) * 255
    with torch.no_grad():
        found, wanted = net(pictures), transcribed(net.state_dict(), pictures)
    for level, (mine, theirs) in enumerate(zip(found, wanted, strict=True)):
        assert mine.shape[1] == LEVEL_CHANNELS[level]
        assert mine.shape[-2:] == tuple(-(-n // 2 ** (level + 1)) for n in size)
        torch.testing.assert_close(mine, theirs, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("size", [(224, 224), (64, 96)])
def test_features_are_those_of_the_public_port_with_its_weights(size):
    public = randomised(EfficientNet.from_name("efficientnet-lite0"))
    net = Lite0Features()
    net.load_public(public.state_dict())
    net.eval()
    pictures = torch.rand(1, 3, *size, generator=torch.manual_seed(0)) * 255
    with torch.no_grad():
        found = net(pictures)
        # The port lays its padding out for 224 x 224, which is right for multiples of 32 alone.
        x = public._swish(public._bn0(public._conv_stem((pictures - 127) / 128)))
        for number, block in enumerate(public._blocks[: LEVELS[-1] + 1]):
            x = block(x)
            if number in LEVELS:
                mine = found[LEVELS.index(number)]
                torch.testing.assert_close(mine, x, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize(("kernel", "stride"), [(3, 1), (3, 2), (5, 1), (5, 2), (1, 1)])
@pytest.mark.parametrize("size", [(8, 8), (7, 9), (8, 11)])
def test_padding_is_as_tensorflow_has_it(kernel, stride, size):
    conv = SameConv(2, 3, kernel, stride)
    x = torch.randn(1, 2, *size)
    with torch.no_grad():
        torch.testing.assert_close(conv(x), same(x, conv.weight, stride))


def test_an_even_map_is_padded_below_and_right_only():
    conv = SameConv(1, 1, 3, 2)
    with torch.no_grad():
        conv.weight.fill_(1)
        found = conv(torch.ones(1, 1, 4, 4))
    # Nine, and six where the window hangs over one side, four at the corner below and right.
    assert found[0, 0].tolist() == [[9, 6], [6, 4]]


def test_weights_that_lack_a_layer_are_not_taken():
    state = Lite0Features().state_dict()
    del state["_blocks.3._bn1.weight"]
    with pytest.raises(KeyError, match=r"_blocks\.3\._bn1\.weight"):
        Lite0Features().load_public(state)


def test_the_features_of_the_change_net_keep_their_statistics_in_training():
    net = SiameseLite().train()
    assert net.compare.training and not net.features.training
    before = net.features._bn0.running_mean.clone()
    net(torch.rand(1, 3, 64, 64) * 255, torch.rand(1, 3, 64, 64) * 255, torch.ones(1, 1, 64, 64))
    assert torch.equal(net.features._bn0.running_mean, before)
