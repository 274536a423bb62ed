"""What a changed object costs a person: actions and seconds, with these tools and with polygons.

A scripted annotator in a real Chromium brings each object of the pairs to an IoU of at least 0.9,
or to where every border pixel is within 1 px: once from the prediction, with the cheapest of
accept, a proposal, click, brush and outline, or from a wiped mask where that is
cheaper; once from an empty mask with polygons only. An action is a click, a drag, a corner or a
key; choosing the tool and zooming count too. Seconds are without time to think. Objects under 12 px
are left out: they are slivers of occluded things. `keys_per_pair` is what a pair costs whose
prediction is right: the rest of the proposals is rejected, the pair submitted, the next one there.
Needs a demo database (`reviewer demo --check`); with `--data` the pairs are those of a folder of
real pairs instead, in a run with the defaults.
"""

from __future__ import annotations

import argparse
import json
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import numpy as np
from browser import DEMO, TOKEN, desk, serve, wait_saved, wait_shown
from desk import copied
from hand import Hand
from objects import ScenePair, load_pairs, objects_of
from planner import own_part, plan_pair, plan_polygon, reached
from playwright.sync_api import expect
from real import open_set, run_of

from reviewer.masks import Mask, decode_rle, encode_png, intersection_over_union
from reviewer.models.clicks.grabcut import GrabCutClicks
from reviewer.store.database import Store
from reviewer.store.pairs import list_pairs
from reviewer.store.revisions import newest_revision

LEAST_PX = 12
GOAL = 0.9
KEYED_PAIRS = 4


@dataclass(slots=True)
class Effort:
    """What was done for how many objects."""

    objects: int = 0
    reached: int = 0
    reached_iou: int = 0
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
        plans = plan_pair(
            segmenter, embedding, pair.predicted, pair.truth, GOAL, LEAST_PX, pair.proposed
        )
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
        effort.reached += reached(part, thing, GOAL)
        effort.reached_iou += intersection_over_union(part, thing) >= GOAL


def work(db: Path, pairs: list[ScenePair], polygons: bool) -> Effort:
    """Do all pairs in one sitting."""
    effort = Effort()
    with copied(db) as copy, serve(copy) as url, Store(copy) as store:
        for pair in pairs:
            start_from(url, pair, np.zeros_like(pair.truth) if polygons else pair.predicted)
        with desk(url) as (page, frame):
            frame.select_option("#source", "all")
            hand = Hand(page, frame)
            for pair in pairs:
                while frame.inner_text("#title") != pair.title:
                    title = frame.inner_text("#title")
                    page.keyboard.press("ArrowRight")
                    expect(frame.locator("#title")).not_to_have_text(title)
                wait_shown(frame, pair.id)
                expect(frame.locator("#proposal-list li")).to_have_count(len(pair.proposed))
                hand.begin()
                do_pair(hand, pair, polygons, store, effort)
    return effort


def keys_per_pair(db: Path, pairs: list[ScenePair]) -> float:
    """Return the keys that a pair costs whose mask is right when it is opened."""
    with copied(db) as copy, serve(copy) as url, Store(copy) as store:
        for pair in list_pairs(store):
            truth = next((p.truth for p in pairs if p.id == pair.id), None)
            if truth is not None:
                start_from(url, ScenePair(pair.id, "", *[truth] * 5), truth)
        with desk(url) as (page, frame):
            frame.select_option("#source", "all")
            hand = Hand(page, frame)
            for _ in range(KEYED_PAIRS):
                title = frame.inner_text("#title")
                hand.begin()
                hand.key("Shift+J")
                expect(frame.locator("#proposal-list li:not([data-outcome])")).to_have_count(0)
                wait_saved(frame)
                hand.key("Enter")
                expect(frame.locator("#title")).not_to_have_text(title)
                wait_shown(frame)
            return hand.actions / KEYED_PAIRS


@contextmanager
def database(given: argparse.Namespace) -> Iterator[Path]:
    """Give the demo database, or one made of a folder of real pairs."""
    if given.data is None:
        yield given.db
        return
    with tempfile.TemporaryDirectory() as place:
        folders = []
        for folder in sorted(path for path in given.data.iterdir() if path.is_dir()):
            folders.append(Path(shutil.copytree(folder, Path(place) / folder.name)))
        db = Path(place) / "real.db"
        with Store(db, create=True) as store:
            open_set(store, folders, "people")
            run_of(store, "dis", {})
        yield db


def main() -> None:
    """Measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--db", type=Path, default=DEMO)
    parser.add_argument("--every", type=int, default=4, help="only each n-th pair")
    parser.add_argument("--json", action="store_true", help="one JSON object")
    parser.add_argument("--data", type=Path, help="a folder of real pairs, layout t0t1")
    arguments = parser.parse_args()
    with database(arguments) as db:
        pairs = list(load_pairs(db, arguments.every))
        keys = keys_per_pair(db, pairs)
        efforts = {
            "from the prediction": work(db, pairs, polygons=False),
            "polygons from empty": work(db, pairs, polygons=True),
        }
    ours, theirs = efforts.values()
    if arguments.json:
        figures = {
            "actions_per_object": ours.actions / ours.objects,
            "actions_per_object_polygon": theirs.actions / theirs.objects,
            "seconds_per_object": ours.seconds / ours.objects,
            "seconds_per_object_polygon": theirs.seconds / theirs.objects,
            "keys_per_pair": keys,
            "reached_iou": ours.reached_iou / ours.objects,
            "reached_iou_polygon": theirs.reached_iou / theirs.objects,
            "reached": ours.reached / ours.objects,
            "reached_polygon": theirs.reached / theirs.objects,
        }
        print(json.dumps(figures))
        return
    print(f"keys_per_pair {keys:g}")
    for name, effort in efforts.items():
        per = effort.actions / effort.objects, effort.seconds / effort.objects
        print(
            f"{name:22} {effort.objects} objects in {len(pairs)} pairs, {effort.reached} reached,"
            f" {effort.reached_iou} at IoU >= {GOAL:g}: {per[0]:.1f} actions, {per[1]:.1f} s an"
            f" object; {effort.ways}"
        )


if __name__ == "__main__":
    main()
