"""How fast scores are under other rules: `sweep_100_ms`, a hundred rules over 1875 pairs.

The pairs are made up: 1875 over twelve splits, each with 2 to 9 components and up to as many
objects, some of which share a component or pixels. What was loaded once is swept many times, so
loading is told apart (`load_1875_s`, from a real database of those pairs' terms as JSON).
"""

from __future__ import annotations

import argparse
import json
import time

import numpy as np
from core import seconds

from reviewer.dataset.demo.world import PAPER_PAIRS
from reviewer.evaluation.outcomes import _packed, _unpacked
from reviewer.evaluation.terms import ObjectTerms, PairTerms
from reviewer.evaluation.whatif import Rule, WhatIf

LIMIT_MS = 100.0


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
    return {"sweep_100_ms": 1000 * seconds(lambda: engine.sweep(rules), 10), "load_1875_s": load}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="one JSON object")
    figures = measure()
    if parser.parse_args().json:
        print(json.dumps(figures))
        return
    mark = "" if figures["sweep_100_ms"] <= LIMIT_MS else "  over the limit"
    print(f"sweep_100_ms {figures['sweep_100_ms']:8.1f}   limit {LIMIT_MS:g}{mark}")
    print(f"load_1875_s  {figures['load_1875_s']:8.2f}")


if __name__ == "__main__":
    main()
