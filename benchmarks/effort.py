"""What a changed object costs a person: actions and seconds, with these tools and with polygons.

A scripted annotator in a real Chromium brings demo pairs to an IoU of at least 0.9 an object: once
from the prediction, with the cheapest of accept, reject (a box around it), click, brush and
outline, or from a wiped mask where that is cheaper; once from an empty mask with polygons only. An
action is a click, a drag, a corner or a key; choosing the tool and zooming count too. Seconds are
without time to think. Objects under 12 px are left out: they are slivers of occluded things.
Needs a demo database (`reviewer demo --check`).
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import numpy as np
from browser import DEMO, TOKEN, desk, serve, wait_saved, wait_shown
from desk import copied
from hand import Hand
from objects import ScenePair, load_pairs, objects_of
from planner import own_part, plan_pair, plan_polygon
from playwright.sync_api import expect

from reviewer.masks import Mask, decode_rle, encode_png, intersection_over_union
from reviewer.models.clicks.grabcut import GrabCutClicks
from reviewer.store.database import Store
from reviewer.store.revisions import newest_revision

LEAST_PX = 12
GOAL = 0.9


@dataclass(slots=True)
class Effort:
    """What was done for how many objects."""

    objects: int = 0
    reached: int = 0
    actions: int = 0
    seconds: float = 0.0
    ways: dict[str, int] = field(default_factory=dict)


def start_from(url: str, pair: ScenePair, mask: Mask) -> None:
    """Make a mask the newest revision, as a script would."""
    headers = {"Authorization": f"Bearer {TOKEN}", "X-Annotator": "Script"}
    with httpx.Client(base_url=url, headers=headers) as client:
        tag = client.get(f"/api/pairs/{pair.id}/mask").headers["ETag"]
        kind = {"If-Match": tag, "Content-Type": "image/png"}
        body = encode_png(mask)
        client.put(f"/api/pairs/{pair.id}/mask", content=body, headers=kind).raise_for_status()


def do_pair(hand: Hand, pair: ScenePair, polygons: bool, store: Store, effort: Effort) -> None:
    """Bring all objects of a pair to the goal."""
    if polygons:
        plans, mask = [], np.zeros_like(pair.truth)
        for thing in objects_of(pair.truth, LEAST_PX):
            plans.append(plan_polygon(mask, thing, GOAL))
            mask = plans[-1].mask
    else:
        segmenter = GrabCutClicks()
        embedding = segmenter.embed(pair.live, pair.warped, pair.confidence, pair.change)
        plans = plan_pair(segmenter, embedding, pair.predicted, pair.truth, GOAL, LEAST_PX)
    before, begun = hand.actions, time.perf_counter()
    for plan in plans:
        hand.carry_out(plan)
        effort.ways[plan.way] = effort.ways.get(plan.way, 0) + 1
    wait_saved(hand.frame)
    effort.seconds += time.perf_counter() - begun
    effort.actions += hand.actions - before
    revision = newest_revision(store, pair.id)
    assert revision is not None
    final = decode_rle(revision.mask)
    for thing in objects_of(pair.truth, LEAST_PX):
        effort.objects += 1
        part = own_part(final, thing, pair.truth)
        effort.reached += intersection_over_union(part, thing) >= GOAL


def work(db: Path, pairs: list[ScenePair], polygons: bool) -> Effort:
    """Do all pairs in one sitting."""
    effort = Effort()
    with copied(db) as copy, serve(copy) as url, Store(copy) as store:
        for pair in pairs:
            start_from(url, pair, np.zeros_like(pair.truth) if polygons else pair.predicted)
        with desk(url) as (page, frame):
            hand = Hand(page, frame)
            for pair in pairs:
                while frame.inner_text("#title") != pair.title:
                    title = frame.inner_text("#title")
                    page.keyboard.press("ArrowRight")
                    expect(frame.locator("#title")).not_to_have_text(title)
                wait_shown(frame, pair.id)
                hand.begin()
                do_pair(hand, pair, polygons, store, effort)
    return effort


def main() -> None:
    """Measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--db", type=Path, default=DEMO)
    parser.add_argument("--every", type=int, default=4, help="only each n-th pair")
    parser.add_argument("--json", action="store_true", help="one JSON object")
    arguments = parser.parse_args()
    pairs = list(load_pairs(arguments.db, arguments.every))
    efforts = {
        "from the prediction": work(arguments.db, pairs, polygons=False),
        "polygons from empty": work(arguments.db, pairs, polygons=True),
    }
    ours, theirs = efforts.values()
    if arguments.json:
        figures = {
            "actions_per_object": ours.actions / ours.objects,
            "actions_per_object_polygon": theirs.actions / theirs.objects,
            "seconds_per_object": ours.seconds / ours.objects,
            "seconds_per_object_polygon": theirs.seconds / theirs.objects,
            "reached": ours.reached / ours.objects,
            "reached_polygon": theirs.reached / theirs.objects,
        }
        print(json.dumps(figures))
        return
    for name, effort in efforts.items():
        per = effort.actions / effort.objects, effort.seconds / effort.objects
        print(
            f"{name:22} {effort.objects} objects in {len(pairs)} pairs, {effort.reached} at"
            f" IoU >= {GOAL:g}: {per[0]:.1f} actions, {per[1]:.1f} s an object; {effort.ways}"
        )


if __name__ == "__main__":
    main()
