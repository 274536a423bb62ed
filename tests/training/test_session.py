"""A training fits, goes on where it was stopped, and never loses its last checkpoint."""

import csv
import json
import math

import numpy as np
import pytest
import torch
from scenes import textured

from reviewer.errors import Conflict, InvalidInput
from reviewer.masks import Mask
from reviewer.metrics import Counts, count, f_score
from reviewer.models import device
from reviewer.models.detectors.net import NetDetector
from reviewer.models.nets import checkpoints
from reviewer.models.nets.build import build_net
from reviewer.models.nets.checkpoints import load_checkpoint
from reviewer.reports.curve import draw_curve
from reviewer.synthesis.bank import Bank, Cutout
from reviewer.synthesis.pairs import TRAINING
from reviewer.synthesis.settings import SynthesisSettings
from reviewer.training.loop import Fit, TrainingFailed
from reviewer.training.session import train
from reviewer.training.settings import TrainingSettings
from reviewer.training.stream import SyntheticData, SyntheticPairs, batches

EASY = SynthesisSettings(changes=(1, 2), unchanged=0, size_px=(20, 40), colour_match=(0, 0))


@pytest.fixture(scope="module")
def data():
    """Two backgrounds and four plain objects."""
    cutouts = tuple(
        Cutout(np.full((24, 30, 3), colour, np.uint8), np.full((24, 30), 255, np.uint8), "block")
        for colour in [(250, 20, 20), (20, 20, 250), (250, 250, 20), (10, 10, 10)]
    )
    bank = Bank(cutouts, {}, "blocks")
    return SyntheticData([textured(0), textured(1)], bank, EASY, {"sha256": "of-test"})


def settings(**given):
    values = {
        "net": "cdnet",
        "width": 0.125,
        "iterations": 6,
        "batch": 2,
        "crop_px": 64,
        "validate_every": 2,
        "validation_pairs": 2,
        "precision": "float32",
        **given,
    }
    return TrainingSettings(**values)


def weights(path):
    return load_checkpoint(path)[0].state_dict()


def same(first, second):
    return all(torch.equal(value, second[key]) for key, value in first.items())


@pytest.mark.parametrize(("net", "lr", "iterations"), [("cdnet", 5e-3, 60), ("dr-tanet", 3e-3, 90)])
def test_a_small_net_overfits_eight_pairs(data, net, lr, iterations):
    wanted = settings(net=net, iterations=iterations, batch=8, lr=lr, betas=(0.9, 0.999))
    torch.manual_seed(0)
    fit = Fit(build_net(net, 0.125), wanted)

    class Eight(SyntheticPairs):
        def pair(self, number):
            return super().pair(number % 8)

    pairs = Eight(data.references, data.bank, EASY, side=64, seed=0, stream=TRAINING)
    before = f_score(_counted(fit, pairs))
    for _ in fit.steps(pairs, until=iterations, workers=0):
        pass
    assert before < 0.5 and f_score(_counted(fit, pairs)) > 0.95


def _counted(fit, pairs):
    fit.net.eval()
    counts = Counts()
    for pictures, classes in batches(pairs, first=0, last=1, batch=8, workers=0):
        with torch.inference_mode():
            found: Mask = (fit._logits(pictures).argmax(1) == 1).numpy()
        counts += count(found.reshape(-1, 64), (classes == 1).numpy().reshape(-1, 64))
    return counts


def test_a_training_leaves_what_a_run_needs(data, tmp_path):
    seen = []
    done = train(
        tmp_path / "a", settings(), data, on_checkpoint=draw_curve, on_validation=seen.append
    )
    assert [at.iteration for at in seen] == [2, 4, 6] and done == seen[-1]
    names = {path.name for path in (tmp_path / "a").iterdir()}
    assert names == {
        "best.pt", "last.pt", "state.pt", "log.csv", "curve.png", "pairs.png", "training.json"
    }  # fmt: skip
    _, record = load_checkpoint(tmp_path / "a" / "last.pt")
    assert record.training["iteration"] == 6 and record.training["training"]["seed"] == 0
    assert record.training["data"]["sha256"] == "of-test"
    assert 0 <= record.training["synthetic_validation"]["f_score"] <= 1
    with (tmp_path / "a" / "log.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["iteration"] for row in rows] == list("123456")
    assert [bool(row["f_score"]) for row in rows] == [False, True] * 3
    assert all(math.isfinite(float(row["loss"])) for row in rows)
    assert [float(r["lr"]) for r in rows] == sorted((float(r["lr"]) for r in rows), reverse=True)
    detector = NetDetector("cdnet", str(tmp_path / "a" / "best.pt"))
    assert detector.detect(textured(0), textured(1), np.ones((120, 160), bool)).max() <= 1


class Killed(BaseException):
    """Stands for a kill: nothing catches it."""


@pytest.mark.parametrize("at", [1, 5])
def test_a_killed_training_goes_on_to_the_same_weights(data, tmp_path, at):
    train(tmp_path / "whole", settings(), data)

    def kill(step):
        if step.iteration == at:
            raise Killed

    with pytest.raises(Killed):
        train(tmp_path / "killed", settings(), data, on_step=kill)
    train(tmp_path / "killed", settings(), data)
    for name in ("last.pt", "best.pt"):
        assert same(weights(tmp_path / "whole" / name), weights(tmp_path / "killed" / name))
    first, second = ((tmp_path / n / "log.csv").read_text() for n in ("whole", "killed"))
    without_speed = [[row.split(",")[:4] for row in text.splitlines()] for text in (first, second)]
    assert without_speed[0] == without_speed[1]


def test_worker_processes_do_not_change_what_is_learnt(data, tmp_path):
    train(tmp_path / "here", settings(iterations=2), data)
    train(tmp_path / "there", settings(iterations=2), data, workers=1)
    assert same(weights(tmp_path / "here" / "last.pt"), weights(tmp_path / "there" / "last.pt"))


def test_a_folder_keeps_to_one_training(data, tmp_path):
    train(tmp_path / "a", settings(iterations=2), data)
    with pytest.raises(Conflict, match="holds a training with another training lr, training seed"):
        train(tmp_path / "a", settings(iterations=2, lr=1.0, seed=4), data)
    other = SyntheticData(data.references, data.bank, EASY, {"sha256": "another"})
    with pytest.raises(Conflict, match="another data sha256; give this one a name"):
        train(tmp_path / "a", settings(iterations=2), other)


def test_the_precision_that_auto_stands_for_is_recorded(data, tmp_path, monkeypatch):
    monkeypatch.setattr(device, "has_bfloat16", lambda: False)
    train(tmp_path / "a", settings(iterations=2, precision="auto"), data)
    noted = json.loads((tmp_path / "a" / "training.json").read_text())["training"]
    assert noted["precision"] == "float32"
    _, record = load_checkpoint(tmp_path / "a" / "last.pt")
    assert record.training["training"]["precision"] == "float32"
    monkeypatch.setattr(device, "has_bfloat16", lambda: True)  # the folder moves to a newer machine
    with pytest.raises(Conflict, match=r"another training precision.*--precision float32 goes on"):
        train(tmp_path / "a", settings(iterations=2, precision="auto"), data)
    assert train(tmp_path / "a", settings(iterations=2), data).iteration == 2


def test_a_training_begun_by_an_early_version_does_not_change_its_net(data, tmp_path):
    train(tmp_path / "a", settings(net="tanet", iterations=2), data)
    path = tmp_path / "a" / "training.json"
    noted = json.loads(path.read_text())
    noted["training"]["net_settings"] = {}  # as they were written down then
    path.write_text(json.dumps(noted))
    with pytest.raises(Conflict, match="another training net_settings"):
        train(tmp_path / "a", settings(net="tanet", iterations=2), data)


def test_a_finished_training_is_left_as_it_is(data, tmp_path):
    train(tmp_path / "a", settings(iterations=2), data)
    before = (tmp_path / "a" / "best.pt").stat().st_mtime_ns
    done = train(tmp_path / "a", settings(iterations=2), data)
    assert done.iteration == 2 and (tmp_path / "a" / "best.pt").stat().st_mtime_ns == before


def test_a_loss_that_is_not_finite_stops_it_and_the_checkpoint_stays(data, tmp_path, monkeypatch):
    calls = []
    right = Fit._loss

    def wrong(self, pictures, classes):
        calls.append(1)
        return right(self, pictures, classes) * (math.nan if len(calls) == 4 else 1)

    monkeypatch.setattr(Fit, "_loss", wrong)
    with pytest.raises(TrainingFailed, match=r"iteration 4: loss nan.*lower --lr"):
        train(tmp_path / "a", settings(), data)
    _, record = load_checkpoint(tmp_path / "a" / "last.pt")
    assert record.training["iteration"] == 2


def test_too_little_memory_is_told_with_the_way_out(data, tmp_path, monkeypatch):
    def full(*_):
        raise torch.OutOfMemoryError("CUDA out of memory")

    monkeypatch.setattr(Fit, "_loss", full)
    with pytest.raises(TrainingFailed, match=r"2 squares of 64 pixels do not fit .* lower --batch"):
        train(tmp_path / "a", settings(), data)


def test_a_full_disk_stops_it_and_the_checkpoint_stays(data, tmp_path, monkeypatch):
    right = torch.save

    def full(content, file):
        if content.get("record", {}).get("training", {}).get("iteration") == 4:
            raise OSError(28, "No space left on device")
        right(content, file)

    monkeypatch.setattr(checkpoints.torch, "save", full)
    with pytest.raises(TrainingFailed, match=r"iteration 4: .*No space left on device"):
        train(tmp_path / "a", settings(), data)
    assert load_checkpoint(tmp_path / "a" / "last.pt")[1].training["iteration"] == 2
    monkeypatch.undo()
    train(tmp_path / "a", settings(), data)
    train(tmp_path / "whole", settings(), data)
    assert same(weights(tmp_path / "a" / "last.pt"), weights(tmp_path / "whole" / "last.pt"))


def test_the_paper_s_settings_are_the_defaults():
    cscdnet = TrainingSettings.of_paper("cscdnet-attention")
    assert (cscdnet.iterations, cscdnet.batch, cscdnet.lr) == (40000, 32, 1e-4)
    assert cscdnet.betas == (0.5, 0.999) and cscdnet.class_weights == (1, 1)
    dr_tanet = TrainingSettings.of_paper("dr-tanet", width=0.5)
    assert (dr_tanet.iterations, dr_tanet.batch, dr_tanet.lr) == (15000, 16, 1e-3)
    assert dr_tanet.width == 0.5 and dr_tanet.crop_px == 256
    with pytest.raises(InvalidInput, match="'difference': cannot be trained"):
        TrainingSettings.of_paper("difference")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"batch": 1}, "batch norm needs at least 2 pairs"),
        ({"iterations": 0}, "iterations: must be >= 1"),
        ({"crop_px": 100}, "a multiple of 64, but is 100"),
        ({"lr": 0.0}, "lr: must be > 0"),
        ({"held_out": 1.0}, "held_out: must lie in"),
        ({"clip_norm": -1.0}, "clip_norm: must be >= 0"),
        ({"class_weights": (1.0, 0.0)}, "class_weights: positive"),
        ({"class_weights": (0.0, 0.0)}, "class_weights: positive"),
    ],
)
def test_settings_out_of_range_are_refused(values, message):
    with pytest.raises(InvalidInput, match=message):
        settings(**values)


def test_a_weight_on_changed_pixels_moves_the_threshold_along(data, tmp_path):
    assert settings().threshold == 0.5
    weighted = settings(iterations=2, class_weights=(1.0, 3.0))
    assert weighted.threshold == 0.75
    train(tmp_path / "a", weighted, data)
    assert load_checkpoint(tmp_path / "a" / "last.pt")[1].threshold == 0.75


@pytest.mark.parametrize(("net", "window"), [("cdnet", 64), ("tanet", 0)])
def test_a_net_that_keeps_to_its_size_is_shown_windows_of_it(data, tmp_path, net, window):
    train(tmp_path / "a", settings(net=net, iterations=2), data)
    assert load_checkpoint(tmp_path / "a" / "last.pt")[1].window_px == window


def test_gradients_are_clipped_to_the_norm(data):
    def norm_of_step(clip):
        torch.manual_seed(0)
        fit = Fit(build_net("cdnet", 0.125), settings(clip_norm=clip))
        pairs = SyntheticPairs(data.references, data.bank, EASY, side=64, seed=0, stream=TRAINING)
        (step,) = fit.steps(pairs, until=1, workers=0)
        total = sum(float(p.grad.square().sum()) for p in fit.net.parameters()) ** 0.5
        return step.gradient_norm, total

    free, same_as_free = norm_of_step(0.0)
    assert same_as_free == pytest.approx(free, rel=1e-4)
    reported, clipped = norm_of_step(free / 10)
    assert reported == pytest.approx(free, rel=1e-4)
    assert clipped == pytest.approx(free / 10, rel=1e-3)
