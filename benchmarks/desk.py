"""Measure the review desk in a real Chromium, inside the Viser page.

Needs a demo database (`reviewer demo --check`). Painting is timed in the page, from the pointer
event to the end of the frame that shows it: 2,000 moves of the brush, half of them after 10 strokes
and half after 500, on 640x480 and on the same picture at 4000x3000. A click is timed from the
release of the button until its candidate is painted on every pane (the screen shows that with its
next frame), less the segmenter's own time (embedding and decoding, as the server reports it).
"""

from __future__ import annotations

import argparse
import json
import re
import sqlite3
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import cv2
import httpx
import numpy as np
from browser import DEMO, TOKEN, desk, serve, wait_saved, wait_shown
from looks import looks
from playwright.sync_api import Frame, Page

from reviewer.masks import encode_rle

LIMITS = {
    "brush_p95_ms": 16.7,
    "brush_p95_ms_4000x3000": 33.0,
    "brush_growth": 1.2,
    "click_overhead_p95_ms": 15.0,
    "next_pair_p95_ms": 100.0,
    "save_p95_ms": 50.0,
    "save_20_people_p95_ms": 100.0,
    "open_pair_gets": 1.0,
}
PEOPLE, SAVES_EACH = 20, 12
LARGE = (4000, 3000)
MOVES = 1000
MOVES_A_STROKE = 40

WATCH = """() => {
    const painted = () => new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
    window.brush = [];
    window.clicks = [];
    window.saves = [];
    const facts = document.getElementById("facts");
    let pressed = 0;
    window.addEventListener("pointerup", () => { pressed = performance.now(); }, true);
    window.addEventListener("pointermove", (event) => {
        if (!event.buttons) return;
        const start = performance.now();
        painted().then(() => window.brush.push(performance.now() - start));
    }, true);
    const own = window.fetch;
    window.fetch = async (...call) => {
        const [start, from] = [performance.now(), pressed];
        const reply = await own(...call);
        const { method, body } = call[1] ?? {};
        if (method === "PUT") window.saves.push(performance.now() - start);
        const clicked = method === "POST" && String(call[0]).endsWith("/click");
        if (clicked && !body.includes('"preview":true')) {
            const answer = reply.clone();
            const drawn = new MutationObserver(async () => {
                if (!facts.textContent.includes("candidate")) return;
                const took = performance.now() - from;
                drawn.disconnect();
                const { embed_ms, predict_ms } = await answer.json();
                window.clicks.push([took, embed_ms + predict_ms]);
            });
            drawn.observe(facts, { childList: true, characterData: true, subtree: true });
        }
        return reply;
    };
}"""

DATA = r"/api/pairs/{}(?![0-9]|/layers)"
"""What is asked for of a pair, its pictures left out."""

NEXT = """async () => {
    const panes = document.getElementById("panes");
    const before = panes.dataset.shown;
    const start = performance.now();
    document.querySelector("button[data-action=next]").click();
    while (!panes.dataset.shown || panes.dataset.shown === before) {
        await new Promise(requestAnimationFrame);
    }
    await new Promise((done) => setTimeout(done));
    return performance.now() - start;
}"""


def strokes(page: Page, frame: Frame, count: int, moves: int) -> None:
    """Draw strokes of so many moves over the live pane."""
    box = frame.locator(".pane canvas").nth(1).bounding_box()
    assert box is not None
    for k in range(count):
        if k % 20 == 0:
            # Paint, then erase the same: every stroke changes something.
            page.keyboard.press("be"[(k // 20) % 2])
        y = box["y"] + box["height"] * (0.3 + 0.5 * ((k * 7) % 20) / 20)
        page.mouse.move(box["x"] + box["width"] * 0.25, y)
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"] * 0.75, y + 15, steps=moves)
        page.mouse.up()
        page.wait_for_timeout(20)


def brush_ms(page: Page, frame: Frame) -> tuple[list[float], list[float]]:
    """Return the times of moves after 10 and after 500 strokes."""
    samples = []
    count = 0
    for after in (10, 500):
        strokes(page, frame, after - count, 3)
        wait_saved(frame, 300)
        frame.evaluate("window.brush.length = 0")
        measured = MOVES // MOVES_A_STROKE
        strokes(page, frame, measured, MOVES_A_STROKE)
        samples.append(list(frame.evaluate("window.brush")))
        count = after + measured
    wait_saved(frame, 300)
    return samples[0], samples[1]


def click_overheads(page: Page, frame: Frame, count: int) -> list[float]:
    """Return what clicks took beyond the segmenter's own time."""
    page.keyboard.press("c")
    box = frame.locator(".pane canvas").nth(1).bounding_box()
    assert box is not None
    rng = np.random.default_rng(3)
    for number in range(1, count + 1):
        x, y = rng.uniform(0.3, 0.7, 2)
        page.mouse.click(box["x"] + box["width"] * x, box["y"] + box["height"] * y)
        while frame.evaluate("window.clicks.length") < number:
            page.wait_for_timeout(10)
        page.keyboard.press("Escape")
        page.wait_for_timeout(250)
    page.keyboard.press("b")
    return [total - own for total, own in frame.evaluate("window.clicks")]


def measure_small(db: Path) -> dict[str, list[float]]:
    """Measure on the demo pairs."""
    with serve(db) as url, desk(url) as (page, frame):
        frame.evaluate(WATCH)
        clicks = click_overheads(page, frame, 60)
        early, late = brush_ms(page, frame)
        saves = list(frame.evaluate("window.saves"))
        pairs, gets = [], []
        asked: list[str] = []
        page.on("request", lambda r: asked.append(r.url) if r.method == "GET" else None)
        for _ in range(30):
            asked.clear()
            pairs.append(float(frame.evaluate(NEXT)))
            page.wait_for_timeout(700)
            pair = frame.get_attribute("#panes", "data-shown")
            gets.append(float(sum(bool(re.search(DATA.format(pair), url)) for url in asked)))
    names = ("brush_early", "brush_late", "save", "click", "next_pair", "gets")
    return dict(zip(names, (early, late, saves, clicks, pairs, gets), strict=True))


def measure_large(db: Path) -> list[float]:
    """Measure the brush on a large pair."""
    with serve(db) as url, desk(url) as (page, frame):
        wait_shown(frame)
        frame.evaluate(WATCH)
        early, late = brush_ms(page, frame)
    return early + late


def crowd_saves(db: Path) -> list[float]:
    """Return what saves take while 20 people each save about once a second, over HTTP."""
    times: list[float] = []

    def person(url: str, number: int) -> None:
        rng = np.random.default_rng(number)
        headers = {"Authorization": f"Bearer {TOKEN}", "X-Annotator": f"Person {number}"}
        with httpx.Client(base_url=url, headers=headers) as client:
            path = f"/api/pairs/{number + 1}/mask"
            tag = client.get(path).headers["ETag"]
            for _ in range(SAVES_EACH):
                time.sleep(rng.uniform(0.5, 1.5))
                mask = encode_rle(rng.random((480, 640)) < 0.002)
                change = {"mask": {"height": 480, "width": 640, "counts": mask.counts}}
                begun = time.perf_counter()
                reply = client.put(path, json=change, headers={"If-Match": tag})
                times.append((time.perf_counter() - begun) * 1e3)
                tag = reply.raise_for_status().headers["ETag"]

    with serve(db) as url, ThreadPoolExecutor(PEOPLE) as pool:
        time.sleep(1)
        for done in [pool.submit(person, url, number) for number in range(PEOPLE)]:
            done.result()
    return times


@contextmanager
def copied(db: Path) -> Iterator[Path]:
    """Copy a database beside its images: what is measured leaves no trace."""
    target = db.with_name("benchmark.db")
    for suffix in ("", "-wal", "-shm"):
        target.with_name(target.name + suffix).unlink(missing_ok=True)
    with sqlite3.connect(db) as source, sqlite3.connect(target) as copy:
        source.backup(copy)
    try:
        yield target
    finally:
        for suffix in ("", "-wal", "-shm"):
            target.with_name(target.name + suffix).unlink(missing_ok=True)


@contextmanager
def enlarged(db: Path) -> Iterator[Path]:
    """Make a database of one demo pair at 4000x3000, aligned, detected, searched and integrated."""
    from reviewer.dataset.files import read_rgb
    from reviewer.dataset.importer import ImportSettings, import_split
    from reviewer.pipeline.runner import prepare_run, run_pipeline
    from reviewer.pipeline.settings import PipelineSettings
    from reviewer.store.database import Store
    from reviewer.store.pairs import list_pairs, pair_ids

    with Store(db) as store:
        pair = list_pairs(store)[0]
    with tempfile.TemporaryDirectory() as folder:
        split = Path(folder) / "cr1"
        for name, image in (("t0", pair.reference), ("t1", pair.live)):
            (split / name).mkdir(parents=True)
            pixels = cv2.resize(read_rgb(image.path), LARGE, interpolation=cv2.INTER_CUBIC)
            cv2.imwrite(str(split / name / "0000.png"), pixels[..., ::-1])
        with Store(Path(folder) / "reviewer.db", create=True) as store:
            import_split(store, "cr1", split, ImportSettings(layout="t0t1"), lambda *_: None)
            run_pipeline(store, prepare_run(store, None, PipelineSettings()), pair_ids(store))
        yield Path(folder) / "reviewer.db"


def main() -> None:
    """Measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--db", type=Path, default=DEMO)
    parser.add_argument("--json", action="store_true", help="one JSON object")
    arguments = parser.parse_args()
    with copied(arguments.db) as db:
        samples = measure_small(db)
    with copied(arguments.db) as db:
        seen = looks(db)
    with copied(arguments.db) as db:
        samples["crowd"] = crowd_saves(db)
    with enlarged(arguments.db) as db:
        large = measure_large(db)
    brush = samples["brush_early"] + samples["brush_late"]
    growth = np.percentile(samples["brush_late"], 95) / np.percentile(samples["brush_early"], 95)
    figures = {
        "brush_p95_ms": brush,
        "brush_p95_ms_4000x3000": large,
        "click_overhead_p95_ms": samples["click"],
        "next_pair_p95_ms": samples["next_pair"],
        "save_p95_ms": samples["save"],
        "save_20_people_p95_ms": samples["crowd"],
        "open_pair_gets": samples["gets"],
    }
    results = {name: float(np.percentile(values, 95)) for name, values in figures.items()}
    results["brush_growth"] = float(growth)
    results |= seen
    if arguments.json:
        print(json.dumps(results))
        return
    for name, values in figures.items():
        p50, p95, p99 = np.percentile(values, (50, 95, 99))
        mark = "" if p95 <= LIMITS[name] else "  over the limit"
        line = f"p50 {p50:7.1f}   p95 {p95:7.1f}   p99 {p99:7.1f}   limit {LIMITS[name]:g}"
        print(f"{name:24} n {len(values):5}   {line}{mark}")
    mark = "" if growth <= LIMITS["brush_growth"] else "  over the limit"
    print(f"{'brush_growth':24} {growth:.2f}   limit {LIMITS['brush_growth']:g}{mark}")
    for name, value in seen.items():
        print(f"{name:24} {value:.2f}")


if __name__ == "__main__":
    main()
