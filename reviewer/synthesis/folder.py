"""Write synthetic pairs as a `t0t1` folder, and show what they look like."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from reviewer.atomic import whole_folder
from reviewer.dataset.files import write_png
from reviewer.masks import boundary, encode_png
from reviewer.synthesis.pairs import SyntheticPair

Image = npt.NDArray[np.uint8]

CHANGED = np.array([255, 64, 64], np.uint8)


def write_folder(
    target: Path,
    count: int,
    make: Callable[[int], SyntheticPair],
    record: dict[str, Any],
    progress: Callable[[int, int], None],
) -> None:
    """Write pairs 0 .. count - 1 as t0/, t1/, mask/ (255 = changed), with settings and a sheet.

    Raises:
        Conflict: when `target` exists and is not empty.
    """
    with whole_folder(target) as folder:
        for name in ("t0", "t1", "mask"):
            (folder / name).mkdir()
        shown = []
        for number in range(count):
            pair = make(number)
            name = f"{number:06d}.png"
            write_png(folder / "t0" / name, pair.reference)
            write_png(folder / "t1" / name, pair.live)
            (folder / "mask" / name).write_bytes(encode_png(pair.mask))
            if number < SHEET_PAIRS:
                shown.append(pair)
            progress(number + 1, count)
        write_png(folder / "contact-sheet.png", contact_sheet(shown))
        (folder / "synthesis.json").write_text(json.dumps(record, indent=1))


SHEET_PAIRS = 12
TILE_WIDTH = 300


def contact_sheet(pairs: Sequence[SyntheticPair]) -> Image:
    """Return a picture of pairs: reference, live, and live with the changes outlined; two a row."""
    tiles = [_tile(pair) for pair in pairs]
    if len(tiles) % 2:
        tiles.append(np.full_like(tiles[0], 24))
    rows = [np.hstack(tiles[k : k + 2]) for k in range(0, len(tiles), 2)]
    sheet = np.vstack(rows)
    head = np.full((34, sheet.shape[1], 3), 24, np.uint8)
    for column in range(6):
        title = ("reference", "live", "changes")[column % 3]
        x = 10 + column * (TILE_WIDTH + 6) + (column // 3) * 12
        cv2.putText(head, title, (x, 23), cv2.FONT_HERSHEY_SIMPLEX, 0.6, (225,) * 3, 1, cv2.LINE_AA)
    return np.vstack([head, sheet])


def outlined(picture: Image, mask: npt.NDArray[np.bool_]) -> Image:
    """Return the picture, greyed, with changed pixels in colour and their rim drawn."""
    out = (picture * 0.45).astype(np.uint8)
    out[mask] = picture[mask]
    out[boundary(mask)] = CHANGED
    return out


def _tile(pair: SyntheticPair) -> Image:
    height, width = pair.mask.shape
    size = (TILE_WIDTH, round(TILE_WIDTH * height / width))
    cells = []
    for picture in (pair.reference, pair.live, outlined(pair.live, pair.mask)):
        small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
        cells.append(cv2.copyMakeBorder(small, 3, 3, 3, 3, cv2.BORDER_CONSTANT, value=(24, 24, 24)))
    row = np.hstack(cells)
    return np.asarray(
        cv2.copyMakeBorder(row, 3, 3, 6, 6, cv2.BORDER_CONSTANT, value=(24, 24, 24)), np.uint8
    )
