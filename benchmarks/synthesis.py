"""Measure how many synthetic pairs one core makes: squares to train on, whole pictures.

On rendered reference images and rendered objects. Run it as `taskset -c 0 python
benchmarks/synthesis.py`; `--json` prints one JSON object.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

import cv2

from reviewer.demo.world import SplitPlan, render_split
from reviewer.synthesis.bank import load_bank
from reviewer.synthesis.demo_bank import write_demo_bank
from reviewer.synthesis.pairs import TRAINING, numbered_pair
from reviewer.synthesis.settings import SynthesisSettings
from reviewer.synthesis.shelf import Shelf

LIMIT = 150.0
"""Pairs a second of 256x256, at least."""


def measure(folder: Path) -> dict[str, float]:
    """Return pairs a second by kind."""
    cv2.setNumThreads(1)
    render_split(folder / "lr1", SplitPlan("lr1", 4, seed=7))
    shelf = Shelf(sorted((folder / "lr1" / "reference").glob("*.png")))
    instances = write_demo_bank(folder / "bank", a_kind=2, seed=1, progress=lambda *_: None)
    bank = load_bank(instances, folder / "bank" / "images", least_area_px=1)
    figures = {}
    for name, side, count in (
        ("pairs_per_s_256", 256, 400),
        ("pairs_per_s_128", 128, 400),
        ("pairs_per_s_640x480", None, 60),
    ):
        best = 0.0
        for _ in range(3):
            start = time.perf_counter()
            for number in range(count):
                numbered_pair(
                    shelf,
                    bank,
                    SynthesisSettings(),
                    seed=0,
                    stream=TRAINING,
                    number=number,
                    side=side,
                )
            best = max(best, count / (time.perf_counter() - start))
        figures[name] = best
    return figures


def main() -> None:
    """Print the figures; exit 1 when squares of 256 are made too slowly."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        figures = measure(Path(folder))
    if arguments.json:
        print(json.dumps(figures))
    else:
        for name, value in figures.items():
            print(f"{name:22} {value:8.1f}")
    sys.exit(0 if figures["pairs_per_s_256"] >= LIMIT else 1)


if __name__ == "__main__":
    main()
