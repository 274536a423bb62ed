"""The nets have their papers' parameters, names and arithmetic."""

from typing import get_args

import pytest
import torch
from references import attention

from reviewer.errors import InvalidInput
from reviewer.models.nets.attention_mask import AttentionMask, descriptor_energy, texture_energy
from reviewer.models.nets.build import NETS
from reviewer.models.nets.temporal_attention import TemporalAttention
from reviewer.models.registry import build_detector
from reviewer.words import NET_NAMES, TrainedNet


def shapes(name, width=1.0, **settings):
    with torch.device("meta"):
        return {
            k: tuple(v.shape)
            for k, v in build_detector(name, width, **settings).state_dict().items()
        }


@pytest.mark.parametrize(
    ("name", "millions"), [("cscdnet", 94.20), ("cdnet", 92.31), ("dr-tanet", 33.39)]
)
def test_width_1_has_the_published_number_of_parameters(name, millions):
    with torch.device("meta"):
        net = build_detector(name, width=1.0)
    assert round(sum(p.numel() for p in net.parameters()) / 1e6, 2) == millions


def test_c3po_has_as_many_parameters_as_its_public_file():
    """536 245 869 bytes for ChangeSim: each parameter and Adam's two moments of it, beside the
    statistics of batch norms and a little wrapping."""
    with torch.device("meta"):
        net = build_detector("c3po", width=1.0)
    values = 3 * sum(p.numel() for p in net.parameters()) + sum(b.numel() for b in net.buffers())
    assert 0 < 536_245_869 - 4 * values < 200_000


def test_rscd_has_the_public_names_and_shapes():
    found = shapes("rscd-dinov2")
    block = "ca0s.0.cross_att_2"
    assert found[f"{block}.multi_head_self_attention.in_proj_weight"] == (1152, 384)
    assert found[f"{block}.feed_forward.0.weight"] == (1536, 384)
    assert found[f"{block}.feed_forward.3.bias"] == found[f"{block}.layer_norm2.weight"] == (384,)
    assert found["conv1.weight"] == (384, 768, 3, 3) and found["conv2.weight"] == (2, 384, 1, 1)
    assert found["backbone.pos_embed"] == (1, 1370, 384)
    assert found["backbone.blocks.11.attn.qkv.weight"] == (1152, 384)
    assert "backbone.blocks.11.attn.proj.weight" not in found
    found = shapes("rscd-resnet18")
    assert found["backbone.layers.0.0.weight"] == (64, 3, 7, 7)
    assert found["backbone.layers.4.0.downsample.1.running_var"] == (512,)
    assert found["ca.cross_att_1.multi_head_self_attention.out_proj.bias"] == (128,)
    assert found["conv1.weight"] == (128, 256, 3, 3)


def test_c3po_has_the_public_names_and_shapes():
    found = shapes("c3po")
    fusion = "backbone.combinefeature"
    assert found["backbone.encoder.layers.0.1.running_mean"] == (64,)
    assert found["backbone.encoder.layers.2.0.downsample.0.weight"] == (128, 64, 1, 1)
    assert found[f"{fusion}.cfs.0.exchange.weight"] == (64, 64, 3, 3)
    assert found[f"{fusion}.cfs.3.res.weight"] == (512, 512, 3, 3)
    assert found[f"{fusion}.cf_inners.1.0.weight"] == (512, 128, 1, 1)
    assert found[f"{fusion}.cf_layers.3.0.bias"] == (512,)
    assert found[f"{fusion}.reduce.weight"] == (512, 2048, 3, 3)
    assert found["classifier.0.convs.0.0.weight"] == (256, 512, 1, 1)
    assert found["classifier.0.convs.4.1.weight"] == (256, 512, 1, 1)
    assert found["classifier.0.convs.4.2.weight"] == (256,)
    assert found["classifier.0.project.0.weight"] == (256, 1280, 1, 1)
    assert found["classifier.1.weight"] == (256, 256, 3, 3) and "classifier.1.bias" not in found
    assert found["classifier.4.weight"] == (2, 256, 1, 1)


def test_cscdnet_has_the_public_names_and_shapes():
    found = shapes("cscdnet")
    for encoder in ("enc1", "enc2"):
        assert found[f"{encoder}_conv1.weight"] == (64, 3, 7, 7)
        assert found[f"{encoder}_res2_1.downsample.0.weight"] == (128, 64, 1, 1)
        assert found[f"{encoder}_res4_2.conv2.weight"] == (512, 512, 3, 3)
        assert f"{encoder}_res1_1.downsample.0.weight" not in found
        assert found[f"{encoder}_conv5.bias"] == (1024,)
    assert found["dec_conv6.weight"] == (1024, 2048, 3, 3)
    assert found["dec_conv5.weight"] == (512, 1024, 3, 3)
    assert found["dec_res4_2.conv2.weight"] == (512, 512 + 1024, 3, 3)
    assert found["dec_res4_1.downsample.2.weight"] == (256,)
    assert found["dec_res2_2.conv1.weight"] == (128, 128 + 256 + 441, 3, 3)
    assert found["dec_res1_2.conv2.weight"] == (64, 64 + 128, 3, 3)
    assert found["dec_conv1.weight"] == (64, 633, 7, 7) and "dec_conv1.bias" not in found
    assert found["classifier.weight"] == (2, 64, 1, 1)
    assert shapes("cdnet")["dec_conv1.weight"] == (64, 192, 7, 7)


def test_dr_tanet_has_the_public_names_and_shapes():
    found = shapes("dr-tanet")
    layer = "attention_module.attention_layer"
    for stage, (channels, side) in enumerate([(64, 7), (128, 5), (256, 3), (512, 1)], start=1):
        assert found[f"{layer}{stage}.w_q.weight"] == (channels, channels, 1, 1)
        assert found[f"{layer}{stage}.rel_h"] == (channels // 2, 1, 1, side, 1)
        assert found[f"{layer}{stage}.rel_w"] == (channels // 2, 1, 1, 1, side)
    assert found["encoder2.layer2.0.downsample.1.running_mean"] == (128,)
    assert found["attention_module.downsample3.weight"] == (512, 512, 3, 3)
    assert found["decoder.upsample1.bottleneck.conv.weight"] == (1024, 512, 1, 1)
    assert found["decoder.upsample4.blend_conv.norm.weight"] == (128,)
    assert found["decoder.upsample4.blend_conv.conv.weight"] == (64, 128, 3, 3)
    assert found["bn.running_var"] == (64,) and found["classifier.bias"] == (2,)
    assert shapes("tanet", window=5)[f"{layer}4.rel_h"] == (256, 1, 1, 5, 1)


@pytest.mark.parametrize("name", NET_NAMES)
def test_every_net_gives_two_logits_a_pixel_and_learns_everywhere(name):
    torch.manual_seed(0)
    net = build_detector(name, width=0.125)
    logits = net(torch.randn(2, 6, 2 * net.multiple, 3 * net.multiple))
    assert logits.shape == (2, 2, 2 * net.multiple, 3 * net.multiple)
    logits.square().mean().backward()
    still = [
        key
        for key, p in net.named_parameters()
        if p.grad is None or not torch.isfinite(p.grad).all()
    ]
    # With a window of one place the softmax is 1: nothing there can learn.
    last = "attention_module.attention_layer4."
    if name == "dr-tanet":
        still = [key for key in still if key not in (last + "rel_h", last + "rel_w")]
    # Public files hold the whole ResNet, of which the second stage is the last that is looked at.
    if name == "rscd-resnet18":
        unseen = ("backbone.layers.3.", "backbone.layers.4.")
        still = [key for key in still if not key.startswith(unseen)]
    assert not still


@pytest.mark.parametrize("name", get_args(TrainedNet))
def test_both_encoders_start_alike_and_are_two(name):
    state = build_detector(name, width=0.125).state_dict()
    first, second = ("enc1_", "enc2_") if "cd" in name else ("encoder1.", "encoder2.")
    own = [key for key in state if key.startswith(first) and state[key].ndim == 4]
    assert own
    for key in own:
        other = state[key.replace(first, second)]
        assert torch.equal(state[key], other) and state[key].data_ptr() != other.data_ptr()


def test_the_registry_and_the_builders_name_the_same_nets():
    assert sorted(NETS) == sorted(NET_NAMES)


@pytest.mark.parametrize(
    ("name", "settings", "message"),
    [
        ("difference", {}, "net 'difference': unknown"),
        ("cscdnet", {"width": 0}, r"width: must lie in \(0, 4\], but is 0"),
        ("tanet", {"window": 4}, "window: must be odd"),
        ("cscdnet-attention", {"level": 1}, "attention level: must be 2 to 5, but is 1"),
        ("cscdnet-attention", {"strength": 1.5}, "attention strength"),
        ("cscdnet-attention", {"source": "mind"}, "there are descriptor-energy, texture-energy"),
        ("cdnet", {"level": 3}, "net cdnet: .*level"),
    ],
)
def test_bad_settings_are_told(name, settings, message):
    with pytest.raises(InvalidInput, match=message):
        build_detector(name, **settings)


@pytest.mark.parametrize("side", [1, 3, 5])
@pytest.mark.parametrize("refinement", [False, True])
def test_temporal_attention_equals_the_unfolded_one(side, refinement):
    torch.manual_seed(side)
    layer = TemporalAttention(16, side, groups=4, refinement=refinement).double()
    past, present = torch.randn(2, 2, 16, 6, 7).double()
    wanted = attention(layer.state_dict(), past, present, side, 4, refinement)
    torch.testing.assert_close(layer(past, present), wanted)


def test_the_order_of_the_pictures_matters_to_dr_tanet():
    torch.manual_seed(0)
    net = build_detector("dr-tanet", width=0.125).eval()
    past, present = torch.randn(1, 3, 64, 64), torch.randn(1, 3, 64, 64)
    there, back = net(torch.cat([past, present], 1)), net(torch.cat([present, past], 1))
    assert not torch.allclose(there, back)


def test_the_attention_mask_damps_what_has_little_energy():
    features = torch.ones(1, 4, 4, 4)
    features[..., :2] = 0.1
    image = torch.zeros(1, 3, 16, 16)
    mask = AttentionMask(3, 0.8)
    damped = mask(features, image)
    assert torch.allclose(damped[..., 2:], features[..., 2:])
    assert torch.allclose(damped[..., :2], features[..., :2] * (0.8 * 0.1 + 0.2))
    assert torch.equal(AttentionMask(3, 0.0)(features, image), features)


def test_a_mask_source_can_be_brought_along():
    features, image = torch.ones(1, 4, 4, 4), torch.zeros(1, 3, 16, 16)
    image[..., 8:] = torch.arange(8.0)
    energy = texture_energy(features, image)
    assert energy.shape == (1, 1, 4, 4) and energy[0, 0, 0, 3] > energy[0, 0, 0, 0] == 0
    assert descriptor_energy(features, image).flatten().tolist() == [2.0] * 16
    left = AttentionMask(2, 1.0, lambda f, i: (torch.arange(4) < 2).float().expand(1, 1, 4, 4))
    assert left(features, image)[0, 0, 0].tolist() == [1, 1, 0, 0]


def test_without_strength_the_mask_changes_nothing_in_the_net():
    torch.manual_seed(0)
    plain = build_detector("cscdnet", width=0.125).eval()
    damped = build_detector("cscdnet-attention", width=0.125, strength=0.0).eval()
    damped.load_state_dict(plain.state_dict())
    pictures = torch.randn(1, 6, 64, 64)
    assert torch.equal(plain(pictures), damped(pictures))
    stronger = build_detector("cscdnet-attention", width=0.125, strength=0.9).eval()
    stronger.load_state_dict(plain.state_dict())
    assert not torch.allclose(plain(pictures), stronger(pictures))
