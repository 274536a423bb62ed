"""Are proposals in the right order, and what do candidates add? Demo worlds or photographs.

    python benchmarks/proposals.py [--db DATABASE] [--run NAME] [--json]

A hit is a proposal with an IoU of at least 0.5 with a changed object (of 12 px and more). Figures a
pair: the rank of the first hit, precision among the first k, how many proposals are listed; for
the order of today, and for the order in which the sources tell them. For the candidates: of the
changed objects that nothing else covers (no proposal with an IoU of 0.5, and less than half of the
pixels), how many one of the first 5 points at (its middle lies within 2 px) or outlines (IoU 0.5).
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from browser import DEMO
from objects import objects_of

from reviewer.editing.proposals import list_proposals
from reviewer.masks import Mask, decode_rle, depth, dilate, intersection_over_union, union
from reviewer.records import Pair, Run
from reviewer.store.database import Store
from reviewer.store.pairs import list_pairs
from reviewer.store.runs import run_or_newest
from reviewer.store.truth import truth_of_pair
from reviewer.words import ProposalSource

LEAST_PX = 12
SMALLEST_PX = 6
HIT = 0.5
DEPTHS = (1, 3, 5)
SOURCES: tuple[ProposalSource, ...] = ("region", "detector", "object_live", "object_reference")
KNOWN: tuple[ProposalSource, ...] = (*SOURCES, "prediction")


@dataclass(slots=True)
class Order:
    """What an order of the proposals gives, pair by pair."""

    first: list[int] = field(default_factory=list)
    listed: list[int] = field(default_factory=list)
    precision: dict[int, list[float]] = field(default_factory=lambda: {k: [] for k in DEPTHS})

    def add(self, hits: list[bool]) -> None:
        """Note the hits of a pair that has changes."""
        self.listed.append(len(hits))
        if True in hits:
            self.first.append(hits.index(True) + 1)
            for k in DEPTHS:
                self.precision[k].append(float(np.mean(hits[:k])))

    def figures(self, name: str) -> dict[str, float]:
        """Return means over the pairs in which anything hits."""
        return {
            f"first_hit_{name}": float(np.mean(self.first)),
            f"first_hit_p90_{name}": float(np.percentile(self.first, 90)),
            **{f"precision_{k}_{name}": float(np.mean(self.precision[k])) for k in DEPTHS},
            f"listed_{name}": float(np.mean(self.listed)),
        }


def things_of(store: Store, pair: Pair, least: int = LEAST_PX) -> list[Mask]:
    """Return the changed objects of a pair."""
    truth = truth_of_pair(store, pair.id)
    return [] if truth is None else objects_of(decode_rle(truth.mask), least)


def measure_order(store: Store, run: Run) -> dict[str, float]:
    """Compare today's order with the sources' own, source by source."""
    ranked, told, seconds = Order(), Order(), []
    for pair in list_pairs(store):
        things = things_of(store, pair)
        begun = time.perf_counter()
        found = list_proposals(store, pair, run, SOURCES)
        seconds.append(time.perf_counter() - begun)
        one_by_one = [p for source in SOURCES for p in told_by(store, pair, run, source)]
        if not things:
            continue
        for order, proposals in ((ranked, found), (told, one_by_one)):
            masks = [decode_rle(proposal.mask) for proposal in proposals]
            order.add([max(intersection_over_union(m, t) for t in things) >= HIT for m in masks])
    return {
        **told.figures("as_told"),
        **ranked.figures("ranked"),
        "list_ms": 1e3 * float(np.mean(seconds)),
    }


def measure_candidates(store: Store, run: Run) -> dict[str, float]:
    """Count the objects that only a candidate tells of."""
    missed, pointed, outlined, listed, seconds = 0, 0, 0, [], []
    for pair in list_pairs(store):
        known = [decode_rle(p.mask) for p in list_proposals(store, pair, run, KNOWN)]
        begun = time.perf_counter()
        found = [decode_rle(p.mask) for p in list_proposals(store, pair, run, ["candidate"])]
        seconds.append(time.perf_counter() - begun)
        listed.append(len(found))
        covered = union(known, pair.live.height, pair.live.width)
        for thing in things_of(store, pair, SMALLEST_PX):
            best = max((intersection_over_union(mask, thing) for mask in known), default=0.0)
            if best >= HIT or 2 * np.count_nonzero(covered & thing) >= np.count_nonzero(thing):
                continue
            missed += 1
            near = dilate(thing, size_px=5)
            pointed += any(near[middle(mask)] for mask in found)
            outlined += any(intersection_over_union(mask, thing) >= HIT for mask in found)
    return {
        "nothing_covers": missed,
        "candidates_point_at": pointed,
        "candidates_outline": outlined,
        "candidates_listed": float(np.mean(listed)),
        "candidates_ms": 1e3 * float(np.mean(seconds)),
    }


def middle(mask: Mask) -> tuple[int, int]:
    """Return row and column of a mask's deepest pixel."""
    row, column = np.unravel_index(int(depth(mask).argmax()), mask.shape)
    return int(row), int(column)


def told_by(store: Store, pair: Pair, run: Run, source: ProposalSource) -> list:
    """Return the proposals of one source as it numbers them."""
    return sorted(list_proposals(store, pair, run, [source]), key=lambda proposal: proposal.number)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--db", type=Path, default=DEMO)
    parser.add_argument("--run", help="in place of the newest run")
    parser.add_argument("--json", action="store_true", help="one JSON object")
    given = parser.parse_args()
    with Store(given.db) as store:
        run = run_or_newest(store, given.run)
        figures = measure_order(store, run) | measure_candidates(store, run)
    if given.json:
        print(json.dumps(figures))
        return
    for name, value in figures.items():
        print(f"{name:24} {value:.3g}")


if __name__ == "__main__":
    main()
