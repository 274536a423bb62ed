"""A bank of objects for users without COCO: the demo's kinds of objects, rendered one by one.

Written as a COCO instances folder, so it is read as COCO is. An object lies on a plain floor under
a lamp and is seen from where the robot would see it, filling the picture; each is a new draw of its
kind. No picture of a demo world is used.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from reviewer.atomic import whole_folder
from reviewer.demo.objects import GROUPS
from reviewer.demo.renderer import Camera, Light, Scene
from reviewer.demo.sensor import Exposure, develop
from reviewer.demo.shapes import Material, Mesh, quad
from reviewer.masks import encode_rle
from reviewer.synthesis.bank import Bank, load_bank

SIDE = 320
OBJECTS_A_KIND = 24
BANK_SEED = 1
MARGIN = 1.15
DISTANCE = 1.2  # metres; far enough for a small object to look as it does from the robot
ELEVATION = (0.45, 1.25)  # radians above the floor under which the robot's camera sees objects


def write_demo_bank(
    folder: Path, *, a_kind: int, seed: int, progress: Callable[[int, int], None]
) -> Path:
    """Render `a_kind` objects of each of the ten kinds into `folder`; return its instances.json.

    Raises:
        InvalidInput: when the folder exists.
    """
    kinds = [(name, maker) for group in GROUPS.values() for name, maker in group.items()]
    images, annotations = [], []
    with whole_folder(folder) as place:
        (place / "images").mkdir()
        for number in range(len(kinds) * a_kind):
            category, (name, maker) = number % len(kinds), kinds[number % len(kinds)]
            rng = np.random.default_rng([seed, number])
            thing = maker(rng)
            picture, mask = _portrait(thing, rng)
            file = f"{number:04d}-{name.replace(' ', '-')}.png"
            if not cv2.imwrite(str(place / "images" / file), picture[..., ::-1]):
                raise OSError(f"{place / 'images' / file}: could not be written")
            rle = encode_rle(mask)
            images.append({"id": number, "file_name": file, "height": SIDE, "width": SIDE})
            annotations.append(
                {
                    "id": number,
                    "image_id": number,
                    "category_id": category,
                    "iscrowd": 0,
                    "area": rle.area,
                    "bbox": list(rle.box_xywh),
                    "segmentation": {"size": [SIDE, SIDE], "counts": rle.counts},
                }
            )
            progress(number + 1, len(kinds) * a_kind)
        content = {
            "images": images,
            "annotations": annotations,
            "categories": [{"id": k, "name": name} for k, (name, _) in enumerate(kinds)],
        }
        (place / "instances.json").write_text(json.dumps(content))
    return folder / "instances.json"


def _portrait(
    thing: Mesh, rng: np.random.Generator
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.bool_]]:
    """Return a picture of an object that fills most of it, and the object's mask."""
    corners = thing.corners.reshape(-1, 3)
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    reach = float(np.linalg.norm(corners - middle, axis=1).max())
    pitch = -float(rng.uniform(*ELEVATION))
    away = DISTANCE * np.array([math.cos(pitch), 0.0, math.sin(pitch)])
    x, y, z = (float(v) for v in middle - away)
    focal = SIDE / 2 * DISTANCE / (MARGIN * reach)
    camera = Camera((x, y, z), 0.0, pitch, SIDE, SIDE, focal)
    side = 3.0
    corners_of_floor = [[-side, -side, 0], [side, -side, 0], [side, side, 0], [-side, side, 0]]
    grey = float(rng.uniform(0.15, 0.6))
    floor = quad(corners_of_floor, Material("plain", (grey, grey, grey)))
    lamp = Light(
        (float(rng.uniform(-1, 1)), float(rng.uniform(-1, 1)), 2.3),
        (0.4, 0.0, 0.0),
        (0.0, 0.4, 0.0),
        (2.2, 2.2, 2.15),
    )
    turned = thing.moved(yaw=float(rng.uniform(0, 2 * math.pi)))
    rendering = Scene([floor, turned], [lamp], (0.3, 0.3, 0.31)).render(camera, rng)
    picture = develop(rendering.light, Exposure(1.75, (1.0, 1.0, 1.0), noise=0.0), rng)
    return picture, rendering.object_number == 1


def open_demo_bank(
    folder: Path, progress: Callable[[int, int], None] = lambda done, total: None
) -> Bank:
    """Return the bank of rendered objects in `folder`, rendered first where it is not there."""
    instances = folder / "instances.json"
    if not instances.exists():
        write_demo_bank(folder, a_kind=OBJECTS_A_KIND, seed=BANK_SEED, progress=progress)
    return load_bank(instances, folder / "images", least_area_px=1)
