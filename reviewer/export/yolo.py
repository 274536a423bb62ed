"""`yolo-seg`: polygons in text files, one per component, class 0 = change; with the live images.

A polygon goes through a component's border pixels, a hole is joined to its outer border by a slit.
Readers fill polygons and draw their borders, so holes come back a pixel narrower all round, and a
slit is filled; nothing that has changed is lost. About one reference image in five, with all its
pairs, is for validation, by its hash: which ones does not hang on what else is exported.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import yaml

from reviewer.export.selection import Labelled, Selection
from reviewer.export.writing import Copy, Files, pair_parts, write_export
from reviewer.masks import Mask, decode_rle

VALIDATION_EVERY = 5
LEAST_POINTS = 3


def export_yolo(labelled: Sequence[Labelled], target: Path, selection: Selection) -> int:
    """Write `data.yaml`, `images/` and `labels/` (train and val); return the number of pairs.

    Raises:
        Conflict: when `target` exists and is not empty.
        NotFound: when an image is gone.
    """

    def files(item: Labelled) -> Files:
        name = f"{_part(item)}/{item.pair.split}__{item.pair.name}"
        lines = "".join(f"{line}\n" for line in polygon_lines(decode_rle(item.mask)))
        return {
            f"images/{name}{item.pair.live.path.suffix.lower()}": Copy(item.pair.live),
            f"labels/{name}.txt": lines.encode(),
        }

    def finish() -> dict[str, bytes]:
        # Where chance holds nothing out (or everything), both are what there is.
        there = {_part(item) for item in labelled}
        train, val = (
            ("train" if "train" in there else "val"),
            ("val" if "val" in there else "train"),
        )
        # Without a path of its own, Ultralytics takes the folder of this file.
        about = {"train": f"images/{train}", "val": f"images/{val}", "names": ["change"]}
        return {"data.yaml": yaml.safe_dump(about, sort_keys=False).encode()}

    settings = {**selection.record(), "validation_every": VALIDATION_EVERY}
    return write_export(target, "yolo-seg", settings, pair_parts(labelled, files), finish=finish)


def _part(item: Labelled) -> str:
    chosen = int(item.pair.reference.sha256[:8], 16) % VALIDATION_EVERY == 0
    return "val" if chosen else "train"


def polygon_lines(mask: Mask) -> list[str]:
    """Return one line per component: class 0 and x, y of every corner, relative to the size."""
    height, width = mask.shape
    contours, tree = cv2.findContours(mask.view(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
    lines = []
    for place, contour in enumerate(contours):
        if tree[0][place][3] >= 0:
            continue
        outline = contour[:, 0]
        for hole in (
            c[:, 0] for c, node in zip(contours, tree[0], strict=True) if node[3] == place
        ):
            outline = _joined(outline, hole)
        # A pixel or a line of pixels is no polygon: its ends are named twice.
        while len(outline) < LEAST_POINTS:
            outline = np.concatenate([outline, outline[-1:]])
        # A quarter of a pixel in: readers that truncate and readers that round find the same one.
        shares = (outline + 0.25) / (width, height)
        lines.append("0 " + " ".join(f"{value:.6f}" for value in shares.ravel()))
    return lines


def _joined(outline: np.ndarray, hole: np.ndarray) -> np.ndarray:
    """Return the outline with a slit to the hole where they are nearest, and back."""
    away = ((outline[:, None] - hole[None]) ** 2).sum(axis=2)
    i, j = np.unravel_index(int(away.argmin()), away.shape)
    around = np.roll(hole, -j, axis=0)
    return np.concatenate(
        [outline[: i + 1], around, around[:1], outline[i : i + 1], outline[i + 1 :]]
    )
