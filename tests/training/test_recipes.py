"""The paper's recipe is the paper's word for word, and says where it differs from our own."""

import json

import cv2
import numpy as np
import pytest
import torch
from checkpoints import resnet18
from scenes import textured, write_split
from typer.testing import CliRunner

from reviewer.cli import app
from reviewer.errors import InvalidInput
from reviewer.models.nets.build import build_net
from reviewer.synthesis.bank import Bank, Cutout
from reviewer.synthesis.pairs import TRAINING, make_pair, pair_rng
from reviewer.training.loop import Fit
from reviewer.training.recipes import PLAIN, iterations_of_epochs, make_recipe
from reviewer.training.stream import SyntheticPairs

TINY = ["--iterations", "2", "--batch", "2", "--crop", "64", "--validation-pairs", "2"]


@pytest.fixture
def bank():
    pixels = np.full((24, 30, 3), (250, 20, 20), np.uint8)
    return Bank((Cutout(pixels, np.full((24, 30), 255, np.uint8), "block"),), {}, "block")


def test_cscdnet_is_as_in_the_paper_and_in_its_public_code():
    recipe = make_recipe("paper", "cscdnet", {}, {})
    settings = recipe.settings
    assert (settings.iterations, settings.decay_over, settings.batch) == (40000, 50000, 32)
    assert (settings.lr, settings.clip_norm, recipe.weights) == (1e-4, 0.0, "last.pt")
    assert (recipe.synthesis.changes, recipe.synthesis.unchanged) == ((1, 1), 0)


def test_dr_tanet_falls_to_the_end_of_its_iterations():
    settings = make_recipe("paper", "dr-tanet", {}, {}).settings
    assert (settings.iterations, settings.decay_over, settings.batch) == (15000, None, 16)


def test_what_differs_is_told_and_recorded():
    recipe = make_recipe("paper", "cscdnet", {"iterations": 100}, {"noise": 4.0})
    found = recipe.differences()
    assert found["training clip_norm"] == (0.0, 5.0)
    assert found["training iterations"] == (100, 40000)
    assert found["synthesis changes"] == ((1, 1), (1, 4))
    assert "synthesis noise" not in found and "training lr" not in found
    assert json.loads(json.dumps(recipe.record()))["differs_from_default"]["synthesis shadow"] == [
        0.0,
        0.6,
    ]
    assert make_recipe("default", "cscdnet", {}, {}).differences() == {}


def test_the_pictures_of_a_pair_differ_by_one_object_and_nothing_else(bank):
    for number in range(20):
        pair = make_pair(textured(0), bank, PLAIN, pair_rng(0, TRAINING, number))
        differs = (pair.reference != pair.live).any(axis=2)
        assert pair.mask.any() and not (differs & ~grown(pair.mask)).any()
        count, _ = cv2.connectedComponents(pair.mask.astype(np.uint8))
        assert count == 2


def grown(mask):
    """The rim of an object that is enlarged fourfold is mixed over as many pixels."""
    return cv2.dilate(mask.astype(np.uint8), np.ones((7, 7), np.uint8)) > 0


def test_the_rate_falls_over_more_iterations_than_there_are(bank):
    given = {"iterations": 2, "batch": 2, "crop_px": 64, "width": 0.125, "precision": "float32"}
    settings = make_recipe("paper", "cdnet", given, {}).settings
    torch.manual_seed(0)
    fit = Fit(build_net("cdnet", 0.125), settings)
    pairs = SyntheticPairs([textured(0)], bank, PLAIN, side=64, seed=0, stream=TRAINING)
    rates = [step.lr for step in fit.steps(pairs, until=2, workers=0)]
    assert rates == pytest.approx([1e-4, 1e-4 * (1 - 1 / 50000)])


def test_a_decay_that_ends_before_the_training_is_refused():
    with pytest.raises(InvalidInput, match=r"decay_over: must be >= iterations \(60000\)"):
        make_recipe("paper", "cscdnet", {"iterations": 60000}, {})


def test_an_epoch_shows_every_reference_image_once():
    assert iterations_of_epochs(3, references=33, batch=16) == 9


@pytest.fixture
def call(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_split(tmp_path / "data" / "cs1")
    torch.save(resnet18(), tmp_path / "resnet18.pth")
    (tmp_path / "coco" / "images").mkdir(parents=True)
    cv2.imwrite(str(tmp_path / "coco" / "images" / "a.png"), np.full((60, 60, 3), 40, np.uint8))
    thing = {"image_id": 1, "category_id": 1, "area": 900}
    boxes = [[5 + k, 5, 35, 5, 35, 35, 5, 35] for k in range(3)]
    content = {
        "images": [{"id": 1, "file_name": "a.png"}],
        "annotations": [{"id": k, "segmentation": [b], **thing} for k, b in enumerate(boxes)],
        "categories": [{"id": 1, "name": "block"}],
    }
    (tmp_path / "coco" / "instances.json").write_text(json.dumps(content))

    def run(*words):
        return CliRunner().invoke(app, [*words])

    run("import", "data")
    return run


def test_the_command_demands_what_the_paper_had(call):
    refused = call("train", "dr-tanet", "--recipe", "paper", *TINY)
    assert "--recipe paper: its encoders start from ImageNet" in str(refused.exception)
    refused = call(
        "train", "dr-tanet", "--recipe", "paper", "--backbone-weights", "resnet18.pth", *TINY
    )
    assert "--recipe paper: pastes COCO objects; give --coco" in str(refused.exception)


def test_the_command_follows_the_recipe_and_writes_it_down(call, tmp_path):
    given = ["--backbone-weights", "resnet18.pth", "--coco", "coco/instances.json"]
    done = call("train", "dr-tanet", "--recipe", "paper", *given, *TINY)
    assert done.exit_code == 0, done.output + repr(done.exception)
    assert "recipe paper, training clip_norm: 0.0 (default 5.0)" in done.output
    assert "recipe paper, synthesis changes: (1, 1) (default (1, 4))" in done.output
    assert "next: reviewer run --detector dr-tanet:" in done.output and "last.pt" in done.output
    noted = json.loads((tmp_path / "trainings/dr-tanet/training.json").read_text())
    assert noted["recipe"]["name"] == "paper"
    assert noted["recipe"]["differs_from_default"]["training clip_norm"] == [0.0, 5.0]


def test_epochs_count_reference_images(call, tmp_path):
    small = ["--width", "0.125", "--batch", "2", "--crop", "64", "--validation-pairs", "2"]
    coco = ["--coco", "coco/instances.json"]
    done = call("train", "dr-tanet", "--epochs", "2", *small, *coco)
    assert "2 epochs of 3 reference images in batches of 2: 4 iterations" in done.output
    noted = json.loads((tmp_path / "trainings/dr-tanet/training.json").read_text())
    assert noted["training"]["iterations"] == 4
    both = call("train", "dr-tanet", "--epochs", "2", "--iterations", "4", *small, *coco)
    assert "--iterations: and --epochs say the same" in str(both.exception)
