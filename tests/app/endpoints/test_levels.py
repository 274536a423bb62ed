"""Smaller sizes of layers, and which of them are kept on disk."""

import cv2
import numpy as np
import pytest

from reviewer.app.endpoints.kept_pictures import PictureCache
from reviewer.app.endpoints.pictures import draw_layer
from reviewer.pipeline.stored import warped_reference
from reviewer.words import SIDES

LAYERS = (
    *SIDES,
    "warped",
    "difference",
    "unseen",
    "detector",
    "objects_live",
    "objects_reference",
    "doi",
    "prediction",
    "ground_truth",
)


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "reviewer" / "pictures"


def pixels(data):
    return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED).astype(int)


@pytest.mark.parametrize("layer", LAYERS)
def test_a_level_halves_a_layer_and_shows_the_same(db, run, tiny_split, layer):
    whole = pixels(draw_layer(db, tiny_split[0], run, layer))
    half = pixels(draw_layer(db, tiny_split[0], run, layer, step=2))
    assert half.shape == (60, 80, whole.shape[2])
    if whole.shape[2] == 4:  # what is coloured is coloured in the same place
        expected = cv2.resize((whole[..., 3] > 0).astype(np.float32), (80, 60), None, 0, 0, 3)
        assert ((half[..., 3] > 0) != (expected >= 0.25)).mean() < 0.05
    elif layer != "difference":
        expected = cv2.resize(whole.astype(np.float32), (80, 60), None, 0, 0, 3)
        assert np.abs(half - expected).mean() < 3


def test_the_warp_of_a_smaller_size_is_the_smaller_warp(db, run, tiny_split):
    whole, valid = warped_reference(db, run, tiny_split[0])
    small, small_valid = warped_reference(db, run, tiny_split[0], 4)
    assert np.abs(cv2.resize(whole, (40, 30), None, 0, 0, 3).astype(int) - small).mean() < 3
    assert small_valid.shape == (30, 40) and abs(small_valid.mean() - valid.mean()) < 0.05


def test_smaller_sizes_are_kept_on_disk_and_found_by_a_new_server(client, run, db, cache):
    path = "/api/pairs/1/layers/live.png"
    assert pixels(client.get(path).content).shape == (120, 160, 3)
    assert not cache.exists()
    assert pixels(client.get(path, params={"level": 2}).content).shape == (30, 40, 3)
    (kept,) = cache.glob("*.png")
    assert pixels(kept.read_bytes()).shape == (30, 40, 3)
    assert client.get(path, params={"level": 9}).status_code == 422


def test_a_preview_of_a_file_that_was_replaced_is_not_shown(client, run, tiny_split):
    path = "/api/pairs/1/layers/live.png?level=1"
    assert client.get(path).status_code == 200
    tiny_split[0].live.path.write_bytes(tiny_split[1].live.path.read_bytes())
    assert client.get(path).status_code == 422


def test_what_was_not_used_for_longest_leaves_the_disk_first(tmp_path):
    cache = PictureCache(tmp_path, disk_bytes=25)
    for number in range(3):
        cache.keep((number,), b"x" * 10)
        path = max(tmp_path.glob("*.png"), key=lambda p: p.stat().st_mtime_ns)
        assert path.stat().st_size == 10
    assert [cache.recall((number,)) is not None for number in range(3)] == [False, True, True]


def test_one_picture_server_finds_what_another_kept(tmp_path):
    PictureCache(tmp_path).keep(("a", 1), b"picture")
    assert PictureCache(tmp_path).recall(("a", 1)) == b"picture"
    assert PictureCache(tmp_path).recall(("a", 2)) is None
