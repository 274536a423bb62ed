"""Ask whether a net trained on squares still sees on whole pictures.

    python benchmarks/size.py DATABASE CHECKPOINT

Scores a checkpoint on synthetic pairs with held-out objects: squares as it was trained on, whole
pictures at once, and whole pictures through windows of the training size.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from reviewer.metrics import Counts, count, f_score, precision, recall
from reviewer.models.detectors.net import NetDetector
from reviewer.models.nets.checkpoints import load_checkpoint
from reviewer.store.database import Store
from reviewer.synthesis.demo_bank import open_demo_bank
from reviewer.synthesis.pairs import VALIDATION, numbered_pair
from reviewer.synthesis.settings import SynthesisSettings
from reviewer.synthesis.shelf import Shelf
from reviewer.training.selection import select_references


def measure(database: Path, checkpoint: Path, pairs: int) -> dict[str, dict[str, float]]:
    """Return precision, recall and F by how the pictures are shown."""
    _, record = load_checkpoint(checkpoint)
    settings = record.training["training"]
    with Store(database) as store:
        shelf = Shelf([i.path for i in select_references(store, [], "same_split")])
        bank = open_demo_bank(store.folder / "object-bank").split(settings["held_out"])[1]
    pasting = SynthesisSettings(
        **{
            k: tuple(v) if isinstance(v, list) else v
            for k, v in record.training["synthesis"].items()
        }
    )
    side = settings["crop_px"]
    scores = {}
    for name, window, cut in (
        (f"squares of {side}", 0, side),
        ("whole", 0, None),
        (f"whole, in windows of {side}", side, None),
    ):
        detector = NetDetector(record.net, str(checkpoint), window=window)
        counts = Counts()
        for number in range(pairs * (4 if cut else 1)):
            pair = numbered_pair(
                shelf, bank, pasting, seed=0, stream=VALIDATION, number=number, side=cut
            )
            everywhere = np.ones(pair.mask.shape, np.bool_)
            found = detector.detect(pair.reference, pair.live, everywhere) > record.threshold
            counts += count(found, pair.mask)
        scores[name] = {"P": precision(counts), "R": recall(counts), "F": f_score(counts)}
    return scores


def main() -> None:
    """Print the scores."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("database", type=Path)
    parser.add_argument("checkpoint", type=Path)
    parser.add_argument("--pairs", type=int, default=20)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    scores = measure(arguments.database, arguments.checkpoint, arguments.pairs)
    if arguments.json:
        print(json.dumps(scores))
        return
    for name, values in scores.items():
        print(f"{name:28}" + "  ".join(f"{k} {v:.3f}" for k, v in values.items()))


if __name__ == "__main__":
    main()
