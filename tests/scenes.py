"""Small made-up splits that the tests work on."""

import csv
from pathlib import Path

import cv2
import numpy as np

from reviewer.masks import encode_png

HEIGHT, WIDTH = 120, 160


def textured(seed: int) -> np.ndarray:
    """A picture with enough texture to be aligned, uint8 RGB."""
    rng = np.random.default_rng(seed)
    coarse = cv2.resize(rng.uniform(60, 190, (15, 20, 3)), (WIDTH, HEIGHT))
    fine = cv2.resize(rng.uniform(-25, 25, (60, 80, 3)), (WIDTH, HEIGHT))
    return np.clip(coarse + fine, 0, 255).astype(np.uint8)


def write_split(folder: Path, pairs: int = 3, first: int = 0) -> Path:
    """Write a split of layout `sequence`: a red square appears in every live image but the last.

    Pictures are numbered from `first`: other numbers, other textures.
    """
    for name in ("reference", "live", "mask"):
        (folder / name).mkdir(parents=True)
    rows = [["session", "name", "stamp", "x", "y", "theta"]]
    for k in range(pairs):
        reference = textured(first + k)
        live, mask = reference.copy(), np.zeros((HEIGHT, WIDTH), bool)
        if k < pairs - 1:
            mask[40:60, 50 + 10 * k : 75 + 10 * k] = True
            live[mask] = (230, 20, 20)
        name = f"{k:04d}"
        cv2.imwrite(str(folder / "reference" / f"{name}.png"), reference[..., ::-1])
        cv2.imwrite(str(folder / "live" / f"{name}.png"), live[..., ::-1])
        (folder / "mask" / f"{name}.png").write_bytes(encode_png(mask))
        rows.append(["reference", name, k, 1.0 * k, 0.02, 0.01])
        rows.append(["live", name, 100 + k, 1.0 * k + 0.03, 0.0, 0.0])
    with (folder / "poses.csv").open("w", newline="") as file:
        csv.writer(file).writerows(rows)
    grid = np.full((40, 80), 254, np.uint8)
    grid[:3] = grid[-3:] = 0
    cv2.imwrite(str(folder / "map.pgm"), grid)
    (folder / "map.yaml").write_text("image: map.pgm\nresolution: 0.1\norigin: [-1, -2, 0]\n")
    return folder
