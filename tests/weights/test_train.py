"""`make weights`: both nets, from what was gathered to where they are shipped from."""

import json
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import torch
from scenes import textured

from reviewer.models.clicks.net_clicks import NetClicks
from reviewer.models.detectors.siamese import SiameseLiteDetector
from reviewer.models.nets.click_net import ClickNet
from reviewer.models.nets.lite0 import Lite0Features
from reviewer.models.nets.small import load_small

SCRIPT = Path(__file__).resolve().parents[2] / "weights" / "train.py"


def gathered(folder):
    """What `sources.py` would have gathered: two backgrounds and one thing."""
    (folder / "backgrounds").mkdir(parents=True)
    (folder / "objects/images").mkdir(parents=True)
    for k in range(2):
        cv2.imwrite(str(folder / f"backgrounds/{k}.jpg"), textured(k))
    picture = np.zeros((60, 60, 3), np.uint8)
    picture[10:40, 10:50] = (20, 20, 240)
    cv2.imwrite(str(folder / "objects/images/1.png"), picture)
    polygon = [[10, 10, 50, 10, 50, 40, 10, 40]]
    content = {
        "images": [{"id": 1, "file_name": "1.png"}],
        "categories": [{"id": 1, "name": "block"}],
        "annotations": [
            {"id": 1, "image_id": 1, "category_id": 1, "area": 1200, "segmentation": polygon}
        ],
    }
    (folder / "objects/instances.json").write_text(json.dumps(content))
    return folder


def test_both_nets_are_trained_the_click_net_beside_the_change_net(tmp_path):
    data, out = gathered(tmp_path / "data"), tmp_path / "shipped"
    torch.save(Lite0Features().state_dict(), tmp_path / "lite0.pth")
    words = [SCRIPT, data, "--out", out, "--backbone", tmp_path / "lite0.pth"]
    command = [sys.executable, *map(str, words), "--steps", "20", "--batch", "2"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "hours of processor time" in done.stdout
    assert done.stdout.count(": sha256 ") == 2
    about = load_small(out / "click-net.safetensors", ClickNet(), "click-net")
    assert about["steps"] == "20" and json.loads(about["training"])["batch"] == 2
    assert NetClicks.load(str(out / "click-net.safetensors")).weights
    detector = SiameseLiteDetector(str(out / "siamese-lite.safetensors"))
    assert json.loads(about["training"])["beside"] == detector.weights


def test_a_training_that_fails_says_why(tmp_path):
    (tmp_path / "backgrounds").mkdir()
    command = [sys.executable, str(SCRIPT), str(tmp_path), "--out", str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 1
    assert "backgrounds: holds no image" in done.stderr
    assert not (tmp_path / "out").exists()
