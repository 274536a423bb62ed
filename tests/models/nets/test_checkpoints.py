"""Checkpoints: ours and the public ones load strictly; others are told what they look like."""

import pickle
from dataclasses import asdict

import pytest
import torch
from checkpoints import resnet18
from seeded import filled, seeded_pictures
from typer.testing import CliRunner

from reviewer.cli import app
from reviewer.errors import InvalidInput, NotFound
from reviewer.models.nets.backbone import load_backbone
from reviewer.models.nets.checkpoints import FORMAT, NetRecord, load_checkpoint, save_checkpoint
from reviewer.models.registry import build_detector

WIDTH = 0.125


@pytest.fixture(scope="module")
def cscdnet():
    return build_detector("cscdnet", WIDTH)


def test_ours_comes_back_with_its_record(tmp_path):
    net = build_detector("cscdnet-attention", WIDTH, level=4, strength=0.3)
    record = NetRecord(
        "cscdnet-attention",
        WIDTH,
        {"level": 4, "strength": 0.3},
        preprocessing="imagenet",
        bn_mode="batch",
        threshold=0.4,
        changed_class=0,
        training={"seed": 3, "data": {"sha256": "ab"}},
    )
    save_checkpoint(tmp_path / "best.pt", net, record)
    loaded, found = load_checkpoint(tmp_path / "best.pt")
    assert found == record and loaded.attention.level == 4
    assert all(torch.equal(v, loaded.state_dict()[k]) for k, v in net.state_dict().items())


@pytest.mark.parametrize(
    ("name", "settings"),
    [("cscdnet", {}), ("cdnet", {}), ("tanet", {"window": 5}), ("dr-tanet", {})],
)
@pytest.mark.parametrize("wrap", [lambda s: s, lambda s: {"state_dict": s, "epoch": 3}])
def test_a_public_checkpoint_is_told_by_keys_and_shapes(tmp_path, name, settings, wrap):
    net = build_detector(name, WIDTH, **settings)
    # As several GPUs and an old torch leave it: a prefix, and no batch counters.
    state = {f"module.{k}": v for k, v in net.state_dict().items() if "num_batches" not in k}
    torch.save(wrap(state), tmp_path / "00040000.pth")
    loaded, record = load_checkpoint(tmp_path / "00040000.pth")
    assert (record.net, record.width) == (name, WIDTH)
    # No key tells whether a TANet refines: the usual is assumed, and said to be.
    untold = {"refinement": name == "dr-tanet", "relu": "block"} if "tanet" in name else {}
    assert record.settings == {**untold, **settings}
    assert record.assumed == (("refinement",) if untold else ())
    assert (record.preprocessing, record.threshold, record.changed_class) == ("bgr_128", 0.5, 1)
    loaded.eval(), net.eval()
    pictures = torch.randn(1, 6, 64, 64)
    assert torch.equal(loaded(pictures), net(pictures))


def test_keys_cannot_tell_the_attention_mask_so_the_caller_does(tmp_path, cscdnet):
    torch.save(cscdnet.state_dict(), tmp_path / "a.pth")
    net, record = load_checkpoint(tmp_path / "a.pth", "cscdnet-attention")
    assert record.net == "cscdnet-attention" and net.attention is not None


def test_a_checkpoint_of_another_net_is_refused(tmp_path, cscdnet):
    torch.save(cscdnet.state_dict(), tmp_path / "a.pth")
    with pytest.raises(InvalidInput, match=r"is a cscdnet \(width 0.125\), not dr-tanet"):
        load_checkpoint(tmp_path / "a.pth", "dr-tanet")


def test_a_record_of_another_width_is_refused_by_the_tensor(tmp_path, cscdnet):
    save_checkpoint(tmp_path / "a.pt", cscdnet, NetRecord("cscdnet", 0.25))
    with pytest.raises(InvalidInput, match=r"does not fit cscdnet of width 0.25: .* is \(8, "):
        load_checkpoint(tmp_path / "a.pt")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (resnet18(), "looks like a torchvision or timm ResNet, which goes to --backbone-weights"),
        ({"vision_encoder.patch_embed.projection.weight": torch.ones(1)}, "looks like a SAM"),
        ({"step": 1}, "a file without weights"),
        ({"a.b": torch.ones(1), "c": torch.ones(2)}, "2 tensors, the first is 'a.b'"),
        ([1, 2], "holds a list, not a dict"),
    ],
)
def test_a_wrong_file_is_told_what_it_looks_like(tmp_path, content, message):
    torch.save(content, tmp_path / "x.pth")
    with pytest.raises(InvalidInput, match=message):
        load_checkpoint(tmp_path / "x.pth")


def test_python_objects_are_not_unpickled(tmp_path, cscdnet):
    torch.save(cscdnet, tmp_path / "model.pth")
    with pytest.raises(InvalidInput, match="save its state_dict"):
        load_checkpoint(tmp_path / "model.pth")


def test_what_is_no_checkpoint_at_all_is_named(tmp_path):
    with pytest.raises(NotFound, match="no such checkpoint file"):
        load_checkpoint(tmp_path / "gone.pt")
    (tmp_path / "a.pt").write_bytes(b"hello there")
    with pytest.raises(InvalidInput, match=r"a\.pt: "):
        load_checkpoint(tmp_path / "a.pt")
    (tmp_path / "b.pt").write_bytes(pickle.dumps({"a": 1}))
    with pytest.raises(InvalidInput, match=r"b\.pt: "):
        load_checkpoint(tmp_path / "b.pt")


def test_weights_that_are_not_finite_are_refused(tmp_path, cscdnet):
    state = {k: v.clone() for k, v in cscdnet.state_dict().items()}
    state["dec_conv6.weight"][0, 0, 0, 0] = float("nan")
    torch.save(state, tmp_path / "x.pth")
    with pytest.raises(InvalidInput, match=r"dec_conv6.weight has values that are not finite"):
        load_checkpoint(tmp_path / "x.pth")


def test_a_missing_or_extra_layer_is_named(tmp_path, cscdnet):
    state = dict(cscdnet.state_dict())
    del state["classifier.bias"]
    torch.save(state, tmp_path / "x.pth")
    with pytest.raises(InvalidInput, match=r"Missing key.*classifier.bias"):
        load_checkpoint(tmp_path / "x.pth")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"preprocessing": "grey"}, "there are bgr_128, imagenet"),
        ({"bn_mode": "off"}, "there are eval, batch"),
        ({"threshold": 1.0}, "threshold: must lie in"),
        ({"window_px": 100}, "window_px: 0 or a multiple of 64"),
        ({"changed_class": 2}, "changed_class: must be 0 or 1"),
    ],
)
def test_a_record_out_of_range_is_refused(values, message):
    with pytest.raises(InvalidInput, match=message):
        NetRecord("cscdnet", **values)


def test_a_failed_save_leaves_the_checkpoint_before(tmp_path, cscdnet, monkeypatch):
    path = tmp_path / "last.pt"
    save_checkpoint(path, cscdnet, NetRecord("cscdnet", WIDTH, training={"iteration": 1}))

    def full(*_):
        raise RuntimeError("unexpected pos 64 vs 0")

    monkeypatch.setattr(torch, "save", full)
    with pytest.raises(OSError, match=r"last\.pt: could not be written"):
        save_checkpoint(path, cscdnet, NetRecord("cscdnet", WIDTH, training={"iteration": 2}))
    assert load_checkpoint(path)[1].training == {"iteration": 1}
    assert [p.name for p in tmp_path.iterdir()] == ["last.pt"]


@pytest.mark.parametrize("name", ["cscdnet", "dr-tanet"])
@pytest.mark.parametrize("suffix", [".pth", ".safetensors"])
def test_a_resnet18_file_fills_both_encoders(tmp_path, name, suffix):
    from safetensors.torch import save_file

    state = resnet18((8, 16, 32, 64))
    path = tmp_path / f"resnet18{suffix}"
    (save_file if suffix == ".safetensors" else torch.save)(state, path)
    net = build_detector(name, WIDTH)
    body = [k for k in state if not k.startswith("fc.")]
    assert load_backbone(net, path) == 2 * len(body)
    own = net.state_dict()
    keys = {
        "cscdnet": ("enc2_res3_1.downsample.0.weight", "enc1_conv1.weight"),
        "dr-tanet": ("encoder2.layer3.0.downsample.0.weight", "encoder1.conv1.weight"),
    }[name]
    assert torch.equal(own[keys[0]], state["layer3.0.downsample.0.weight"])
    assert torch.equal(own[keys[1]], state["conv1.weight"])


@pytest.mark.parametrize(
    ("state", "message"),
    [
        (resnet18(), r"conv1.weight is \(64, 3, 7, 7\), but this net has"),
        (resnet18(deep=True), "a deeper ResNet than 18"),
        ({"features.0.weight": torch.ones(3)}, "not a ResNet-18 in torchvision or timm naming"),
    ],
)
def test_another_backbone_is_refused(tmp_path, state, message):
    torch.save(state, tmp_path / "b.pth")
    with pytest.raises(InvalidInput, match=message):
        load_backbone(build_detector("dr-tanet", WIDTH), tmp_path / "b.pth")


@pytest.mark.parametrize("name", ["tanet", "dr-tanet"])
def test_a_checkpoint_of_an_early_version_gives_what_it_gave(tmp_path, name):
    early = filled(build_detector(name, WIDTH, relu="stage"))
    record = asdict(NetRecord(name, WIDTH))
    del record["settings"]["relu"], record["settings"]["refinement"], record["assumed"]
    torch.save(
        {"format": FORMAT, "record": record, "state": early.state_dict()}, tmp_path / "early.pt"
    )
    loaded, found = load_checkpoint(tmp_path / "early.pt")
    assert found.settings == {"refinement": name == "dr-tanet", "relu": "stage"}
    pictures = seeded_pictures(64, 64)
    assert torch.equal(loaded.eval()(pictures), early(pictures))
    save_checkpoint(tmp_path / "again.pt", loaded, found)
    assert load_checkpoint(tmp_path / "again.pt")[1] == found


def test_a_record_without_settings_is_of_the_public_net(tmp_path):
    save_checkpoint(tmp_path / "a.pt", build_detector("tanet", WIDTH), NetRecord("tanet", WIDTH))
    assert load_checkpoint(tmp_path / "a.pt")[1].settings == {"refinement": False, "relu": "block"}


def test_refinement_can_be_given_to_a_public_file(tmp_path):
    public = filled(build_detector("dr-tanet", WIDTH, refinement=False))
    torch.save(public.state_dict(), tmp_path / "public.pth")

    def said(*words):
        result = CliRunner().invoke(app, ["checkpoint", *words])
        return result.exit_code, str(result.output) + str(result.exception or "")

    code, text = said(str(tmp_path / "public.pth"))
    assert code == 0 and "refinement: True (assumed: the file does not tell)" in text
    path = tmp_path / "known.pt"
    code, text = said(str(tmp_path / "public.pth"), "--no-refinement", "--save", str(path))
    assert code == 0 and "refinement: False\n" in text
    loaded, record = load_checkpoint(path)
    assert record.assumed == () and record.settings["refinement"] is False
    pictures = seeded_pictures(64, 64)
    assert torch.equal(loaded.eval()(pictures), public(pictures))


def test_refinement_is_no_setting_of_other_nets(tmp_path, cscdnet):
    torch.save(cscdnet.state_dict(), tmp_path / "a.pth")
    result = CliRunner().invoke(app, ["checkpoint", str(tmp_path / "a.pth"), "--refinement"])
    assert isinstance(result.exception, InvalidInput)
    assert "is about TANet and DR-TANet, not cscdnet" in str(result.exception)
