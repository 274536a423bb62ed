"""How fast evaluation and export of 1875 pairs are.

`sweep_100_ms` is a hundred DoI rules over 1875 made-up pairs, each with 2 to 9 components and up to
as many objects, some of which share a component or pixels; `load_1875_s` reads their terms from the
JSON they are kept in, once. On 1875 imported pairs of 640x480, with the truth moved by three pixels
as `base` and by one as `doi`: `protocols_1875_s` is all protocols from stored counts,
`boundary_1875_s` object and boundary scores from masks, `t0t1_1875_s` pictures and masks written.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

import numpy as np
from core import import_all, repeat_split, seconds

from reviewer.demo.world import PAPER_PAIRS, SplitPlan, render_split
from reviewer.evaluation.counting import refresh_counts
from reviewer.evaluation.outcomes import _packed, _unpacked
from reviewer.evaluation.protocols import Protocol, protocol_lines
from reviewer.evaluation.rules import Rule
from reviewer.evaluation.shapes import shape_rows
from reviewer.evaluation.terms import ObjectTerms, PairTerms
from reviewer.evaluation.whatif import WhatIf
from reviewer.export.selection import Selection, select_labelled
from reviewer.export.t0t1 import export_t0t1
from reviewer.masks import decode_rle, encode_rle
from reviewer.pipeline.runner import prepare_run
from reviewer.pipeline.settings import PipelineSettings
from reviewer.store.database import Store
from reviewer.store.regions import StoredIntegration
from reviewer.store.results import StageResult, save_results
from reviewer.store.revisions import newest_revisions
from reviewer.store.scores import pair_scores

LIMITS = {
    "sweep_100_ms": 100.0,
    "load_1875_s": 1.0,
    "protocols_1875_s": 0.2,
    "boundary_1875_s": 20.0,
    "t0t1_1875_s": 15.0,
}


def made_pairs() -> list[tuple[str, PairTerms]]:
    """Return (split, terms) of 1875 made-up pairs."""
    rng = np.random.default_rng(0)
    return [(split, _pair(rng)) for split, number in PAPER_PAIRS.items() for _ in range(number)]


def _pair(rng: np.random.Generator) -> PairTerms:
    count = int(rng.integers(2, 10))
    parts = tuple((int(tp), int(fp)) for tp, fp in rng.integers(0, 400, (count, 2)))
    objects = []
    for number in range(int(rng.integers(0, count + 1))):
        touched = {number, int(rng.integers(0, count))} if rng.random() < 0.2 else {number}
        overlap = int(rng.integers(0, 50)) if rng.random() < 0.3 else 0
        objects.append(ObjectTerms(float(rng.random()), overlap, tuple(sorted(touched))))
    atoms = [((k,), *(int(v) for v in rng.integers(0, 400, 2))) for k in range(len(objects))]
    if len(objects) > 1 and rng.random() < 0.2:
        atoms.append(((0, 1), 40, 10))
    image = ObjectTerms(float(rng.random()), 0, tuple(range(count))) if objects else None
    return PairTerms(int(rng.integers(100, 3000)), parts, tuple(objects), tuple(atoms), image)


def on_pairs(folder: Path) -> dict[str, float]:
    """Import 1875 pairs with moved masks, and time what looks at all of them."""
    for name, count in PAPER_PAIRS.items():
        render_split(folder / "one" / name, SplitPlan(name, 1, 11))
        repeat_split(folder / "one" / name, folder / "many" / name, count)
    with Store(folder / "many" / "reviewer.db", create=True) as store:
        import_all(store, folder / "many")
        move_masks(store)
        refresh_counts(store)
        everything = Selection()

        def protocols() -> None:
            for kind in ("pooled", "image_mean", "mean_pr"):
                protocol_lines(pair_scores(store), Protocol(kind))

        def export() -> None:
            labelled, _ = select_labelled(store, everything)
            assert export_t0t1(store, labelled, folder / "set", everything) == 1875

        return {
            "protocols_1875_s": seconds(protocols, 5),
            "boundary_1875_s": seconds(lambda: shape_rows(store)),
            "t0t1_1875_s": seconds(export),
        }


def move_masks(store: Store) -> None:
    """Give every pair two predictions: the truth, moved."""
    run = prepare_run(store, "moved", PipelineSettings())
    for pair_id, revision in newest_revisions(store).items():
        truth = decode_rle(revision.mask)
        base, final = (encode_rle(np.roll(truth, by, axis=(0, 1))) for by in (3, 1))
        made = StoredIntegration((), base, final)
        save_results(store, run.id, pair_id, [StageResult("integrate", "made up", 0.0, made)])


def measure() -> dict[str, float]:
    """Return the figures."""
    pairs = made_pairs()
    texts = [(split, terms.truth_px, _packed(terms)) for split, terms in pairs]
    start = time.perf_counter()
    engine = WhatIf([(split, _unpacked(truth_px, text)) for split, truth_px, text in texts])
    load = time.perf_counter() - start
    rules = [
        Rule(low, high, tolerance, scope)
        for low in (0.0, 0.05)
        for high in np.linspace(0.5, 1.0, 5).tolist()
        for tolerance in (0, 5, 10, 20, 40)
        for scope in ("component", "image")
    ]
    assert len(rules) == 100 and len(pairs) == 1875
    with tempfile.TemporaryDirectory() as folder:
        figures = on_pairs(Path(folder))
    return {
        "sweep_100_ms": 1000 * seconds(lambda: engine.sweep(rules), 10),
        "load_1875_s": load,
        **figures,
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="one JSON object")
    figures = measure()
    if parser.parse_args().json:
        print(json.dumps(figures))
        return
    for name, limit in LIMITS.items():
        mark = "" if figures[name] <= limit else "  over the limit"
        print(f"{name:14} {figures[name]:8.2f}   limit {limit:g}{mark}")


if __name__ == "__main__":
    main()
