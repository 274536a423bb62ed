"""Rooms to learn from: models on their feet, and two views whose geometry is true."""

import importlib.util
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from scenes import textured

from reviewer.demo import texture_library
from reviewer.models.warping import warp_image, warp_mask
from reviewer.synthesis.rendered import piece_of
from reviewer.synthesis.views import ViewSettings

FOLDER = Path(__file__).resolve().parents[2] / "weights"
SLAB = """v 0 0 0
v 4 0 0
v 4 1 0
v 0 1 0
v 0 0 2
v 4 0 2
v 4 1 2
v 0 1 2
usemtl first
f 1 2 3 4
f 5 6 7 8
usemtl second
f 1 2 6 5
f 4 3 7 8
f 1 4 8 5
f 2 3 7 6
"""


@pytest.fixture(scope="module")
def rooms():
    sys.path.insert(0, str(FOLDER))
    try:
        spec = importlib.util.spec_from_file_location("rooms", FOLDER / "rooms.py")
        module = importlib.util.module_from_spec(spec)
        sys.modules["rooms"] = module
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(FOLDER))
    before = dict(texture_library.MAKERS)
    module.photo_textures([textured(k) for k in range(3)])
    yield module
    texture_library.MAKERS.clear()
    texture_library.MAKERS.update(before)


@pytest.fixture(scope="module")
def slabs(rooms, tmp_path_factory):
    """The OBJ files of an archive with a slab four long, one high and two deep."""
    folder = tmp_path_factory.mktemp("models")
    with zipfile.ZipFile(folder / "Two.sh3f", "w") as content:
        content.writestr("slab/slab.obj", SLAB)
        content.writestr("empty/empty.obj", "v 0 0 0\n")
        content.writestr("huge/huge.obj", "#" * 1_000_000)
        content.writestr("slab/slab.png", b"")
    return sys.modules["models"].unpack_models([folder / "Two.sh3f"], folder / "out")


def test_models_are_unpacked_without_pictures_and_huge_ones(slabs):
    assert [path.name for path in slabs] == ["empty.obj", "slab.obj"]


def test_a_model_stands_on_the_floor_at_its_size_with_a_surface_for_each_part(slabs):
    load_model = sys.modules["models"].load_model
    mesh = load_model(slabs[1], 0.8, np.random.default_rng(0))
    points = mesh.corners.reshape(-1, 3)
    extent = points.max(axis=0) - points.min(axis=0)
    assert extent == pytest.approx([0.8, 0.4, 0.2], abs=1e-5)
    assert points[:, 2].min() == pytest.approx(0, abs=1e-6)
    assert len(mesh.materials) == 2 and len(mesh.corners) == 12
    assert load_model(slabs[0], 0.8, np.random.default_rng(0)) is None


@pytest.fixture(scope="module")
def views(rooms, slabs):
    return [rooms.make_room(slabs, [5, number]) for number in range(3)]


def test_the_flow_leads_to_the_same_surface_wherever_it_is_seen(views):
    for shown in views:
        flow = shown.flow.astype(np.float32)
        still = shown.seen & (shown.came == 0) & (shown.left == 0)
        warped = warp_image(shown.reference, flow).astype(float)
        live = shown.live.astype(float)
        apart = np.abs(warped - live).mean(axis=2)
        # Another hour's light: what matters is that far-away places differ more than the same.
        shuffled = np.abs(np.roll(warped, 60, axis=1) - live).mean(axis=2)
        assert still.mean() > 0.3
        assert np.median(apart[still]) < 0.7 * np.median(shuffled[still])


def test_where_a_thing_went_its_place_leads_to_it_in_the_reference(views):
    assert any(shown.left.any() for shown in views)
    for shown in views:
        flow = shown.flow.astype(np.float32)
        for number in np.unique(shown.left[shown.left > 0]):
            found = warp_mask(shown.went == number, flow)
            place = shown.left == number
            assert (found & place).sum() >= 0.9 * place.sum()


def test_things_came_and_the_same_seed_gives_the_same_room(rooms, slabs, views):
    assert any(shown.came.any() for shown in views)
    again = rooms.make_room(slabs, [5, 0])
    assert np.array_equal(again.live, views[0].live)
    assert np.array_equal(again.came, views[0].came)
    assert not np.array_equal(views[0].live, views[1].live)
    piece = piece_of(again, ViewSettings(side=320), np.random.default_rng(0))
    assert piece.live.shape == (320, 320, 3)
