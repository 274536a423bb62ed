"""The demo world is deterministic, and its masks are exact."""

import hashlib

import numpy as np
import pytest

from reviewer.dataset.files import read_rgb
from reviewer.dataset.poses import read_map, read_poses
from reviewer.dataset.truths import read_two_levels
from reviewer.demo.objects import GROUPS
from reviewer.demo.renderer import Camera, Scene
from reviewer.demo.rooms import WORKSPACES
from reviewer.demo.shapes import Material, box
from reviewer.demo.world import PAPER_PAIRS, SplitPlan, plan_splits, render_split
from reviewer.masks import components

TRUE_SIZES = {  # metres, longest and second side
    "smartphone": (0.147, 0.072), "notebook": (0.210, 0.152), "pen": (0.142, 0.013),
    "wallet": (0.112, 0.092), "ic card": (0.0856, 0.054), "screw": (0.045, 0.012),
    "battery": (0.0505, 0.0145), "clip": (0.054, 0.041),
}  # fmt: skip


def hashes(folder):
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    folder = tmp_path_factory.mktemp("world") / "hw1"
    render_split(folder, SplitPlan("hw1", 2, 7))
    return folder


def test_the_same_seed_gives_the_same_bytes(rendered, tmp_path):
    render_split(tmp_path / "hw1", SplitPlan("hw1", 2, 7))
    assert hashes(tmp_path / "hw1") == hashes(rendered)


def test_masks_cover_objects_and_nothing_else(rendered):
    for k in range(2):
        mask = read_two_levels(rendered / "mask" / f"{k:04d}.png").changed
        live = read_rgb(rendered / "live" / f"{k:04d}.png").astype(int)
        assert mask.shape == (480, 640) == live.shape[:2]
        assert mask.mean() < 0.05
    assert any(read_two_levels(p).changed.any() for p in (rendered / "mask").iterdir())


def test_the_poses_and_the_map_can_be_read(rendered):
    poses = read_poses(rendered / "poses.csv")
    assert set(poses) == {(s, f"{k:04d}") for s in ("reference", "live") for k in range(2)}
    image, grid = read_map(rendered / "map.yaml", rendered)
    assert image.name == "map.pgm" and grid.resolution == 0.05
    first, second = poses["reference", "0000"].pose, poses["live", "0000"].pose
    assert 0 < abs(first.x - second.x) + abs(first.theta - second.theta) < 0.5


def test_twelve_splits_have_the_papers_sizes():
    plans = plan_splits(None, 7)
    assert len(plans) == 12 and sum(plan.pairs for plan in plans) == 1875
    assert (min(PAPER_PAIRS.values()), max(PAPER_PAIRS.values())) == (82, 314)


@pytest.mark.parametrize("name", TRUE_SIZES)
def test_objects_have_their_true_size_and_lie_on_the_floor(name):
    maker = next(kinds[name] for kinds in GROUPS.values() if name in kinds)
    corners = maker(np.random.default_rng(0)).corners.reshape(-1, 3)
    longest, second = sorted(np.ptp(corners, axis=0), reverse=True)[:2]
    assert (longest, second) == (
        pytest.approx(TRUE_SIZES[name][0], rel=0.06),
        pytest.approx(TRUE_SIZES[name][1], rel=0.2, abs=0.003),
    )
    assert corners[:, 2].min() == pytest.approx(0, abs=0.003)


def test_a_box_is_seen_where_the_pinhole_camera_puts_it():
    floor = box((4, 4, 0.01), Material()).moved(2, 0, -0.01)
    thing = box((0.1, 0.2, 0.2), Material()).moved(2.05, 0, 0.4)
    scene = Scene([floor, thing], [], (0.5, 0.5, 0.5))
    camera = Camera((0.0, 0.0, 0.5), 0.0, 0.0)
    picture = scene.render(camera, np.random.default_rng(0))
    _, (part,) = components(picture.object_number == 1)
    half = camera.focal * 0.1 / 2.0
    left, top, right, bottom = (round(v) for v in (320 - half, 240 - half, 320 + half, 240 + half))
    assert part.box_xyxy == (left, top, right, bottom)
    assert picture.distance[240, 320] == pytest.approx(2.0, abs=1e-3)


@pytest.mark.parametrize("name", WORKSPACES)
def test_every_workspace_has_a_path_inside_its_walls(name):
    room = WORKSPACES[name](np.random.default_rng(0))
    path = np.array(room.path)
    assert (path > 0.5).all() and (path < np.array(room.size) - 0.5).all()
    assert np.isfinite(room.mesh.corners).all() and len(room.lights) >= 1
