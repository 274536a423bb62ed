"""Which pairs carry a doubt: photographs that cannot be compared, and pairs that can.

Prints JSON: for every set the number of pairs, how many carry a doubt and by which measure, the
pairs that do, and the extremes of what is measured. Sets: two views of a room far apart (`frames`:
each must carry one), the same frames under smooth waves of 6 px and more (`waves`: no warp follows
them; each must carry one), fixed cameras (`fixed`: none may), and the demo world, if its database
is named (few). With DIS, the default aligner, and the difference detector; `--aligner` for others.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from reviewer.dataset.files import read_rgb
from reviewer.errors import ReviewerError
from reviewer.masks import decode_rle
from reviewer.models.detectors.difference import DifferenceDetector
from reviewer.models.interfaces import Image
from reviewer.models.registry import build_aligner
from reviewer.models.warping import warp_image
from reviewer.pipeline.fields import load_flow, store_alignment, store_detection
from reviewer.store.database import Store
from reviewer.store.pairs import list_pairs

WIDTH = 640
WAVES = ((6, 12), (12, 20), (25, 40))
"""Standard deviation of the displacement, and its reach, both in pixels."""

Views = tuple[str, Image, Image]


def frames(folder: Path) -> Iterator[Views]:
    """Two views of a room, far apart."""
    for line in (folder / "real_frames/pairs.txt").read_text().splitlines():
        past, present = line.split()[:2]
        yield past, *(_sized(read_rgb(folder / "real_frames" / name)) for name in (past, present))


def waves(folder: Path) -> Iterator[Views]:
    """A frame, and the same under waves, brighter and with noise."""
    rng = np.random.default_rng(0)
    for name, past, _ in frames(folder):
        for size_px, reach_px in WAVES:
            shape = past.shape[:2]
            moves = cv2.GaussianBlur(rng.standard_normal((*shape, 2)), (0, 0), reach_px)
            moves *= size_px / moves.std()
            rows, columns = np.mgrid[: shape[0], : shape[1]]
            x, y = np.float32(columns + moves[..., 0]), np.float32(rows + moves[..., 1])
            moved = cv2.remap(past, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
            seen = np.clip(moved * 1.1 + rng.normal(0, 4, moved.shape), 0, 255).astype(np.uint8)
            yield f"{name} {size_px} px", past, seen


def fixed(folder: Path) -> Iterator[Views]:
    """Cameras on a wall; people walk by."""
    for split in sorted((folder / "real_pairs").iterdir()):
        for live in sorted((split / "t1").glob("*")) if split.is_dir() else ():
            yield f"{split.name}/{live.stem}", read_rgb(split / "t0" / live.name), read_rgb(live)


def demo(db: Path) -> Iterator[Views]:
    """The pairs of a demo database."""
    with Store(db) as store:
        for pair in list_pairs(store):
            yield pair.title, read_rgb(pair.reference.path), read_rgb(pair.live.path)


def _sized(image: Image) -> Image:
    height = round(image.shape[0] * WIDTH / image.shape[1])
    return np.asarray(cv2.resize(image, (WIDTH, height), interpolation=cv2.INTER_AREA), np.uint8)


def count(views: Iterator[Views], aligner_name: str) -> dict[str, Any]:
    """Judge every pair of a set."""
    aligner, detector = build_aligner(aligner_name), DifferenceDetector()
    doubts: dict[str, str] = {}
    back: list[float] = []
    shares: list[float] = []
    pairs = refused = 0
    for name, reference, live in views:
        pairs += 1
        try:
            alignment = store_alignment(aligner.align(reference, live), reference, live)
        except ReviewerError:
            refused += 1  # a failed stage is told in the queue already
            continue
        warped = warp_image(reference, load_flow(alignment))
        found = store_detection(detector.detect(warped, live, decode_rle(alignment.valid)), 0.5)
        doubt = "; ".join(filter(None, (alignment.doubt, found.doubt)))
        if doubt:
            doubts[name] = doubt
        if alignment.backward_px is not None:
            back.append(alignment.backward_px)
        shares.append(found.mask.area / live[..., 0].size)
    measures = {"reaches": "reach", "forward-backward": "there and back", "larger": "worse picture",
                "still differs": "left over", "called changed": "changed"}  # fmt: skip
    by = Counter(
        title for doubt in doubts.values() for word, title in measures.items() if word in doubt
    )
    return {
        "pairs": pairs,
        "refused": refused,
        "doubted": len(doubts),
        "by": dict(by),
        "backward_px": [round(f(back), 2) for f in (min, max)] if back else None,
        "largest_share_changed": round(max(shares, default=0.0), 3),
        "doubts": doubts,
    }


def main() -> None:
    """Count and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--data", type=Path, required=True, help="folder with real_frames/ and real_pairs/"
    )
    parser.add_argument("--demo", type=Path, help="database of a demo world")
    parser.add_argument("--aligner", default="dis")
    given = parser.parse_args()
    sets = {"frames": frames, "waves": waves, "fixed": fixed}
    found = {name: count(views(given.data), given.aligner) for name, views in sets.items()}
    if given.demo:
        found["demo"] = count(demo(given.demo), given.aligner)
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
