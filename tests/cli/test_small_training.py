"""`train clicks` and `train change`: on photographs or reference images, resumed, or refused."""

import cv2
import numpy as np
import pytest
import torch
from scenes import textured
from typer.testing import CliRunner

from reviewer.cli import app
from reviewer.errors import ReviewerError
from reviewer.models.clicks.net_clicks import NetClicks
from reviewer.models.nets.lite0 import Lite0Features
from reviewer.models.nets.siamese_lite import SiameseLite
from reviewer.models.nets.small import load_small
from reviewer.training.small_session import VIEWS_PX


@pytest.fixture(autouse=True)
def small_views(monkeypatch):
    for net in VIEWS_PX:
        monkeypatch.setitem(VIEWS_PX, net, 64)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with photographs and a COCO file of one thing, without a database."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "photos").mkdir()
    for k in range(2):
        cv2.imwrite(str(tmp_path / "photos" / f"{k}.png"), textured(k))
    (tmp_path / "coco/images").mkdir(parents=True)
    picture = np.full((60, 60, 3), 20, np.uint8)
    picture[10:40, 10:50] = (20, 20, 240)
    cv2.imwrite(str(tmp_path / "coco/images/a.png"), picture)
    (tmp_path / "coco/instances.json").write_text(
        '{"images": [{"id": 1, "file_name": "a.png"}], "categories": [{"id": 1, "name": "block"}],'
        '"annotations": [{"id": 1, "image_id": 1, "category_id": 1, "area": 1200,'
        '"segmentation": [[10, 10, 50, 10, 50, 40, 10, 40]]}]}'
    )
    return tmp_path


def call(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


SHORT = ["--iterations", 20, "--batch", 2, "--coco", "coco/instances.json"]
PHOTOS = ["--backgrounds", "photos"]


def test_a_change_net_is_trained_on_photographs_without_a_database_and_resumes(folder):
    done = call("train", "change", *SHORT, *PHOTOS)
    assert done.exit_code == 0, done.output
    path = folder / "trainings/change/siamese-lite.safetensors"
    assert f"next: reviewer run --detector siamese-lite:{path}" in done.output
    assert "change, step 20 of 20: loss of change " in done.output
    assert load_small(path, SiameseLite(), "siamese-lite")["steps"] == "20"
    before = path.read_bytes()
    again = call("train", "change", *SHORT, *PHOTOS)
    assert again.exit_code == 0 and "step 20" not in again.output
    assert path.read_bytes() == before
    other = call("train", "change", *SHORT, *PHOTOS, "--seed", 1)
    assert "give this one a name of its own with --name" in str(other.exception)
    named = call("train", "change", *SHORT, *PHOTOS, "--seed", 1, "--name", "second")
    assert named.exit_code == 0 and (folder / "trainings/second/training.json").exists()


def test_a_click_net_goes_on_from_the_package_on_the_reference_images(folder, tiny_split):
    done = call("train", "clicks", *SHORT, "--start", "shipped", "--lr", "1e-4")
    assert done.exit_code == 0, done.output
    path = folder / "trainings/clicks/click-net.safetensors"
    assert f"next: reviewer serve --click click-net:{path}" in done.output
    assert f"reviewer run --segmenter object-net:{path}" in done.output
    assert NetClicks.load(str(path)).weights != NetClicks.load().weights
    ran = call("run", "--name", "own", "--segmenter", f"object-net:{path}")
    assert "run own: 3 pairs done, 0 were done before, 0 failed" in ran.output, ran.output


def test_a_trained_change_net_is_the_detector_of_a_run(folder, tiny_split):
    assert call("train", "change", *SHORT).exit_code == 0
    path = folder / "trainings/change/siamese-lite.safetensors"
    ran = call("run", "--name", "own", "--detector", f"siamese-lite:{path}")
    assert "run own: 3 pairs done, 0 were done before, 0 failed" in ran.output, ran.output


def test_a_public_backbone_is_taken(folder):
    torch.save(Lite0Features().state_dict(), folder / "lite0.pth")
    words = ["train", "change", *SHORT, *PHOTOS, "--backbone-weights", "lite0.pth"]
    assert call(*words).exit_code == 0
    torch.save({"conv1.weight": torch.zeros(1)}, folder / "lite0.pth")
    refused = call(*words, "--name", "b")
    assert "lite0.pth: holds no EfficientNet-Lite0" in str(refused.exception)


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["clicks", "--width", "0.5"], "--width: is about detectors, not about clicks"),
        (["change", "--from-ground-truth"], "--from-ground-truth: is about detectors"),
        (["change", *PHOTOS, "--split", "cs1"], "--split: is about reference images, which --back"),
        (["clicks", "--backbone-weights", "a.pth"], "--backbone-weights: clicks has no backbone"),
        (
            ["change", "--start", "shipped", "--backbone-weights", "a.pth"],
            "--backbone-weights: --start brings features of its own",
        ),
        (["change", "--backgrounds", "nowhere"], "nowhere: is no folder of photographs"),
        (["change", "--backgrounds", "coco"], "coco: holds no image; there should be photographs"),
        (["change"], "reviewer.db"),
        (["cdnet", *PHOTOS], "--backgrounds: is for clicks and change, not for cdnet"),
        (["change", *PHOTOS, *SHORT, "--iterations", "9"], "at least 20 iterations, not 9"),
        (
            ["clicks", *PHOTOS, *SHORT, "--start", "no.safetensors"],
            "no.safetensors: weights of click-net do not exist",
        ),
    ],
)
def test_what_does_not_fit_is_refused_by_name(folder, words, why):
    done = call("train", *words)
    assert isinstance(done.exception, ReviewerError)
    assert why in str(done.exception)
    assert not (folder / "trainings").exists()
