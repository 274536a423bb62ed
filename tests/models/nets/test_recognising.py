"""Files of C-3PO and RSCD as their trainings leave them: recognised, joined, or refused."""

import zipfile
from argparse import Namespace

import numpy as np
import pytest
import torch
from checkpoints import resnet18
from seeded import filled, seeded_pictures
from typer.testing import CliRunner

from reviewer.cli import app
from reviewer.errors import InvalidInput
from reviewer.models.nets.checkpoints import load_checkpoint
from reviewer.models.nets.rscd import RscdDino
from reviewer.models.registry import build_detector, open_detector
from reviewer.pipeline.fields import store_detection

WIDTH = 0.25
FIRST_RSCD = {"name": "dino2 + cross_attention", "layer1": 3, "num-heads": 1}


def said(*words):
    result = CliRunner().invoke(app, ["checkpoint", *map(str, words)])
    return str(result.output) + str(result.exception or "")


def c3po_file(path, net, **args):
    """What its `train.py` saves: the model beside the optimizer and the command line."""
    content = {
        "model": net.state_dict(),
        "optimizer": {"state": {0: {"step": 3, "exp_avg": torch.zeros(2)}}, "param_groups": []},
        "lr_scheduler": {"last_epoch": 3, "_last_lr": [np.float64(0.1)]},
        "epoch": 3,
    }
    torch.save({**content, **({"args": Namespace(**args)} if args else {})}, path)
    return path


def rscd_file(path, net, **model):
    """What its `train.py` saves: what learns, as several GPUs name it, beside all settings."""
    frozen = "backbone." if isinstance(net, RscdDino) else "nothing"
    learnt = {
        f"module.{key}": value
        for key, value in net.state_dict().items()
        if not key.startswith(frozen)
    }
    args = {"model": {**FIRST_RSCD, "facet1": "query", "facet2": "query", **model}}
    torch.save({"model": learnt, "args": args, "epoch": 9, "logs": [np.float32(0.5)]}, path)
    return path


def dinov2_file(path, net, more=()):
    """DINOv2 as its makers publish it: with what lies behind the queries."""
    whole = filled(build_detector("rscd-dinov2", WIDTH, depth=5, side=4))
    start = {k: v for k, v in net.state_dict().items() if k.startswith("backbone.")}
    state = {
        key.removeprefix("backbone."): start.get(key, value)
        for key, value in whole.state_dict().items()
        if key.startswith("backbone.")
    }
    torch.save({**state, "mask_token": torch.zeros(1, 128), **dict(more)}, path)
    return path


@pytest.mark.parametrize(
    ("args", "settings", "squeeze"),
    [
        (
            {"mtf": "iade", "train_dataset": "ChangeSim_Binary", "input_size": 256},
            {"merging": "iade"},
            256,
        ),
        ({"mtf": "id", "train_dataset": "VL_CMU_CD", "input_size": 512}, {"merging": "id"}, 512),
        ({"mtf": "iade", "train_dataset": "PCD_CV", "input_size": 256}, {"merging": "iade"}, 0),
    ],
)
def test_a_c3po_says_what_it_was_trained_for(tmp_path, args, settings, squeeze):
    net = filled(build_detector("c3po", WIDTH, **settings))
    loaded, record = load_checkpoint(c3po_file(tmp_path / "best.pth", net, **args))
    assert (record.net, record.width, record.settings) == ("c3po", WIDTH, settings)
    assert (record.preprocessing, record.squeeze_px) == ("imagenet", squeeze)
    assert (record.threshold, record.assumed) == (0.5, ())
    pictures = seeded_pictures(64, 96)
    assert torch.equal(loaded.eval()(pictures), net(pictures))


def test_a_c3po_without_its_command_line_can_be_told(tmp_path):
    net = filled(build_detector("c3po", WIDTH, merging="id"))
    path = c3po_file(tmp_path / "bare.pth", net)
    assert load_checkpoint(path)[1].assumed == ("merging",)
    assert "merging: iade (assumed: the file does not tell)" in said(path)
    known = tmp_path / "known.pt"
    text = said(path, "--merging", "id", "--squeeze", 512, "--first", "live", "--save", known)
    assert "merging: id\n" in text
    assert "squeezed to 512 x 512 pixels, whole, the live one first" in text
    loaded, record = load_checkpoint(known)
    assert (record.settings, record.assumed) == ({"merging": "id"}, ())
    assert (record.squeeze_px, record.first) == (512, "live")
    pictures = seeded_pictures(64, 64)
    assert torch.equal(loaded.eval()(pictures), net(pictures))


def test_merging_is_no_setting_of_other_nets(tmp_path):
    torch.save(build_detector("cdnet", 0.125).state_dict(), tmp_path / "a.pth")
    assert "--merging: is about C-3PO, not cdnet" in said(tmp_path / "a.pth", "--merging", "id")


def test_a_c3po_of_several_classes_is_refused(tmp_path):
    state = build_detector("c3po", WIDTH).state_dict()
    state["classifier.4.weight"] = torch.zeros(5, 64, 1, 1)
    torch.save({"model": state}, tmp_path / "multi.pth")
    with pytest.raises(InvalidInput, match=r"multi\.pth: a C-3PO of 5 classes, but 2 are needed"):
        load_checkpoint(tmp_path / "multi.pth")


def test_scores_that_an_older_numpy_has_written_are_no_obstacle(tmp_path):
    net = filled(build_detector("c3po", WIDTH))
    new = c3po_file(tmp_path / "new.pth", net, mtf="iade")
    with zipfile.ZipFile(new) as source, zipfile.ZipFile(tmp_path / "old.pth", "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name.endswith("data.pkl"):
                assert b"numpy._core.multiarray" in content
                content = content.replace(b"numpy._core.multiarray", b"numpy.core.multiarray")
            target.writestr(name, content)
    assert load_checkpoint(tmp_path / "old.pth")[1].net == "c3po"


def test_an_rscd_is_joined_with_the_dinov2_that_was_frozen_under_it(tmp_path):
    settings = {"depth": 4, "side": 4, "attention_blocks": 2, "attention_heads": 2}
    net = filled(build_detector("rscd-dinov2", WIDTH, **settings))
    head = rscd_file(tmp_path / "head.pth", net, **{"num-heads": 2})
    below = dinov2_file(tmp_path / "dinov2.pth", net)
    joined = tmp_path / "joined.pt"
    text = said(head, "--backbone-weights", below, "--save", joined)
    assert "next: reviewer run --detector rscd-dinov2:" in text
    loaded, record = load_checkpoint(joined, "rscd-dinov2")
    assert (record.width, record.settings) == (1 / 3, settings)
    assert (record.preprocessing, record.squeeze_px) == ("unit", 0)
    pictures = seeded_pictures(56, 84)
    assert torch.equal(loaded.eval()(pictures), net(pictures))


@pytest.mark.parametrize(
    ("below", "message"),
    [
        (None, r"holds the head of an RSCD alone, .* --backbone-weights DINOV2\.pth"),
        (resnet18(), "not a DINOv2 in its public naming; looks like a torchvision or timm ResNet"),
        ({"register_tokens": torch.zeros(1, 4, 128)}, "with registers, but RSCD has none"),
        ({"pos_embed": torch.zeros(1, 17, 384)}, "has 384 channels, but the head in .* has 128"),
        ({"blocks.0.attn.qkv.weight": torch.zeros(1, 1)}, r"qkv.weight is \(1, 1\), but should be"),
    ],
)
def test_an_rscd_without_its_dinov2_says_what_is_missing(tmp_path, below, message):
    net = filled(build_detector("rscd-dinov2", WIDTH, depth=4, side=4))
    head = rscd_file(tmp_path / "head.pth", net)
    path = None if below is None else tmp_path / "below.pth"
    if below is not None and "fc.weight" in below:
        torch.save(below, path)
    elif below is not None:
        dinov2_file(path, net, below)
    with pytest.raises(InvalidInput, match=message):
        load_checkpoint(head, backbone=path)


def test_an_rscd_on_keys_is_refused(tmp_path):
    net = filled(build_detector("rscd-dinov2", WIDTH, depth=4, side=4))
    path = rscd_file(tmp_path / "keys.pth", net, facet2="key")
    with pytest.raises(InvalidInput, match="on the key, query of DINOv2, but only its queries"):
        load_checkpoint(path, backbone=dinov2_file(tmp_path / "dinov2.pth", net))


@pytest.mark.parametrize("stage", [1, 2, 4])
def test_an_rscd_on_a_resnet_holds_all_it_needs(tmp_path, stage):
    net = filled(build_detector("rscd-resnet18", WIDTH, stage=stage), seed=2)
    path = rscd_file(tmp_path / "resnet.pth", net, name="resnet18 + cross_attention")
    loaded, record = load_checkpoint(path)
    assert (record.net, record.width) == ("rscd-resnet18", WIDTH)
    assert record.settings == {"stage": stage, "attention_heads": 1}
    assert record.preprocessing == "unit"
    pictures = seeded_pictures(64, 64)
    assert torch.equal(loaded.eval()(pictures), net(pictures))


def test_where_an_rscd_says_nothing_nothing_has_changed(tmp_path):
    """Its ReLU makes both logits 0, which the public argmax calls unchanged."""
    net = build_detector("rscd-resnet18", WIDTH)
    torch.nn.init.zeros_(net.conv2.weight)
    torch.nn.init.constant_(net.conv2.bias, -1)
    path = rscd_file(tmp_path / "silent.pth", net)
    detector = open_detector("rscd-resnet18", {"checkpoint": str(path)})
    picture = np.zeros((64, 64, 3), np.uint8)
    probability = detector.detect(picture, picture, np.ones((64, 64), bool))
    assert (probability == 0.5).all()
    assert store_detection(probability, detector.threshold).mask.area == 0
