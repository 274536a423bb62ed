"""A training of a small net keeps to its folder, resumes there, and leaves weights that run."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
import torch
from scenes import textured
from tiny_views import block_bank

from reviewer.errors import Conflict, InvalidInput
from reviewer.models.clicks.net_clicks import NetClicks
from reviewer.models.detectors.siamese import SiameseLiteDetector
from reviewer.models.nets.lite0 import Lite0Features
from reviewer.models.nets.siamese_lite import SiameseLite
from reviewer.models.nets.small import load_small, small_weights
from reviewer.synthesis.rendered import RenderedViews, save_rendered
from reviewer.synthesis.views import ViewSettings
from reviewer.training import small_session
from reviewer.training.change_loop import ChangeTraining
from reviewer.training.click_loop import ClickTraining
from reviewer.training.loop import TrainingFailed
from reviewer.training.small_session import SmallData, train_small

CHANGE = ChangeTraining(steps=20, batch=2)


@pytest.fixture(scope="module")
def data():
    pictures = [textured(0), textured(1)]
    return SmallData(pictures, ["a", "b"], block_bank(), ViewSettings(side=64))


class Killed(BaseException):
    pass


def kill_at(step):
    def on_step(now, losses):
        if now == step:
            raise Killed

    return on_step


def test_weights_are_saved_on_the_way_and_a_killed_training_ends_the_same(
    data, tmp_path, monkeypatch
):
    monkeypatch.setattr(small_session, "SAVE_EVERY", 8)
    whole = train_small(tmp_path / "whole", "change", CHANGE, data)
    saved = []
    with pytest.raises(Killed):
        train_small(tmp_path / "cut", "change", CHANGE, data, on_step=kill_at(11))
    about = load_small(tmp_path / "cut/siamese-lite.safetensors", SiameseLite(), "siamese-lite")
    assert about["steps"] == "8"
    cut = train_small(
        tmp_path / "cut", "change", CHANGE, data, on_saved=lambda step, path: saved.append(step)
    )
    assert saved == [16, 20]
    assert cut.read_bytes() == whole.read_bytes()


def test_the_header_says_what_made_the_weights_and_no_date(data, tmp_path):
    path = train_small(tmp_path / "a", "change", CHANGE, data)
    about = load_small(path, SiameseLite(), "siamese-lite")
    training = json.loads(about.pop("training"))
    assert about == {
        "net": "siamese-lite", "steps": "20", "seed": "0", "data_sha256": data.record()["sha256"]
    }  # fmt: skip
    assert (training["net"], training["batch"], len(training["backbone"])) == ("change", 2, 64)


def test_a_click_net_goes_on_from_the_weights_of_the_package_and_answers_clicks(data, tmp_path):
    losses = []
    path = train_small(
        tmp_path / "a", "clicks", ClickTraining(steps=20, batch=4, rate=1e-4), data,
        start=small_weights("click-net"), on_step=lambda step, found: losses.append(found),
    )  # fmt: skip
    assert path.name == "click-net.safetensors"
    assert len(losses) == 20 and set(losses[0]) == {"mask", "rating"}
    assert NetClicks.load(str(path)).weights != NetClicks.load().weights


def test_the_features_are_those_of_the_package_unless_a_backbone_is_given(data, tmp_path):
    shipped, made = SiameseLite(), SiameseLite()
    load_small(small_weights("siamese-lite"), shipped, "siamese-lite")
    load_small(train_small(tmp_path / "a", "change", CHANGE, data), made, "siamese-lite")
    for key, value in shipped.features.state_dict().items():
        assert torch.equal(made.features.state_dict()[key], value), key
    torch.manual_seed(3)
    other = Lite0Features()
    torch.save({"_fc.weight": torch.zeros(3), **other.state_dict()}, tmp_path / "lite0.pth")
    path = train_small(tmp_path / "b", "change", CHANGE, data, backbone=tmp_path / "lite0.pth")
    load_small(path, made, "siamese-lite")
    kept = made.features.state_dict()["_conv_stem.weight"]
    assert torch.equal(kept, other.state_dict()["_conv_stem.weight"].half().float())
    assert SiameseLiteDetector(str(path)).weights


def test_a_backbone_of_another_kind_is_refused(data, tmp_path):
    torch.save({"conv1.weight": torch.zeros(3)}, tmp_path / "resnet.pth")
    with pytest.raises(InvalidInput, match=r"resnet.pth: holds no EfficientNet-Lite0, '_conv_stem"):
        train_small(tmp_path / "a", "change", CHANGE, data, backbone=tmp_path / "resnet.pth")
    assert not (tmp_path / "a").exists()


def test_a_start_of_the_other_net_is_refused(data, tmp_path):
    with pytest.raises(InvalidInput, match="weights of 'click-net', but siamese-lite is wanted"):
        train_small(tmp_path / "a", "change", CHANGE, data, start=small_weights("click-net"))


def test_a_folder_keeps_to_one_training(data, tmp_path):
    train_small(tmp_path / "a", "change", CHANGE, data)
    with pytest.raises(Conflict, match=r"with another training batch, training seed; give this"):
        train_small(tmp_path / "a", "change", replace(CHANGE, seed=1, batch=3), data)
    fewer = replace(data, backgrounds=data.backgrounds[:1], background_hashes=["a"])
    with pytest.raises(Conflict, match="with another data backgrounds, data sha256"):
        train_small(tmp_path / "a", "change", CHANGE, fewer)


def test_the_hash_of_the_data_stands_for_pictures_things_and_views(data):
    first = data.bank.objects[0]
    other = replace(first, pixels=np.roll(first.pixels, 1, axis=2))
    hashes = {
        each.record()["sha256"]
        for each in (
            data,
            replace(data, background_hashes=["a", "c"]),
            replace(data, views=ViewSettings(side=128)),
            replace(data, bank=replace(data.bank, objects=(other, *data.bank.objects[1:]))),
        )
    }
    assert len(hashes) == 4


def test_half_of_the_views_are_pieces_of_rendered_rooms_where_there_are_any(data, tmp_path):
    picture, nothing = np.full((80, 90, 3), 77, np.uint8), np.zeros((80, 90), np.uint8)
    flow = np.zeros((80, 90, 2), np.float16)
    save_rendered(
        tmp_path / "0.npz",
        RenderedViews(picture, picture, flow, nothing == 0, nothing, nothing, nothing, nothing),
    )
    roomy = replace(data, rooms=[tmp_path / "0.npz"])
    assert roomy.record()["rooms"] == 1 and roomy.record()["sha256"] != data.record()["sha256"]
    rng, flat = np.random.default_rng(0), 0
    for _ in range(60):
        live = roomy.make(rng).live
        flat += cv2.blur(live, (9, 9)).std(axis=(0, 1)).max() < 6
    assert 15 < flat < 45


def test_a_cycle_that_is_too_short_is_refused(data, tmp_path):
    with pytest.raises(InvalidInput, match="training of change: at least 20 iterations, not 10"):
        train_small(tmp_path / "a", "change", ChangeTraining(steps=10), data)


def test_a_rate_of_nothing_is_refused(data, tmp_path):
    with pytest.raises(InvalidInput, match=r"training of change: lr must be > 0, but is 0.0"):
        train_small(tmp_path / "a", "change", replace(CHANGE, rate=0.0), data)


def test_a_full_disk_is_told_and_the_weights_before_stay(data, tmp_path, monkeypatch):
    monkeypatch.setattr(small_session, "SAVE_EVERY", 8)
    save = small_session.save_small

    def fails_late(path, net, name, about):
        if about["steps"] == "16":
            raise OSError("no space left on device")
        save(path, net, name, about)

    monkeypatch.setattr(small_session, "save_small", fails_late)
    with pytest.raises(TrainingFailed, match="step 16: the weights could not be written, no space"):
        train_small(tmp_path / "a", "change", CHANGE, data)
    path = tmp_path / "a/siamese-lite.safetensors"
    assert load_small(path, SiameseLite(), "siamese-lite")["steps"] == "8"
