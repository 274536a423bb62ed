"""A pair of 4000x3000 pixels in a real Chromium: how soon it is there, and how clicks answer.

    python benchmarks/large.py [--db DATABASE | --large DATABASE] [--json]

The pair is made of the first one of a demo database (or given, with `--large`, as this script or
`desk.py` makes it). Opening is timed inside the workbench, from the request for the pair until its
last picture is there: `first` with a new server and no kept previews, `again` after a reload,
`kept` with a new server and the previews of before. A click is timed from the release of the button
until its candidate is painted on every pane, with each click segmenter that needs no weights of
others.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
from contextlib import nullcontext
from pathlib import Path

import numpy as np
from browser import DEMO, desk, serve, wait_shown
from desk import WATCH, copied, enlarged
from playwright.sync_api import Frame, Page

LIMITS = {"open_first_s": 1.0, "open_again_s": 0.3, "open_kept_s": 1.0, "click_p95_ms": 300.0}
CLICKS = 15
SEGMENTERS = ("grabcut", "click-net")

TOOK = """() => {
    const all = performance.getEntriesByType("resource");
    const asked = all.filter(({ name }) => /pairs.[0-9]+(.open|[?]|$)/.test(name));
    const came = all.filter(({ name }) => name.includes("/layers/"));
    return Math.max(...came.map((each) => each.responseEnd)) - asked[0].startTime;
}"""
RELOAD = "() => { document.body.dataset.old = 'yes'; location.reload(); }"


def opened_s(frame: Frame) -> float:
    """Load the workbench again; seconds until the pair is there."""
    frame.evaluate(RELOAD)
    frame.wait_for_selector("body:not([data-old])", timeout=120_000)
    wait_shown(frame)
    return took_s(frame)


def click_times(page: Page, frame: Frame) -> list[float]:
    """Return what clicks took until they were painted, milliseconds."""
    frame.evaluate(WATCH)
    page.keyboard.press("c")
    box = frame.locator(".pane canvas").nth(1).bounding_box()
    assert box is not None
    rng = np.random.default_rng(3)
    for number in range(1, CLICKS + 1):
        x, y = rng.uniform(0.3, 0.7, 2)
        page.mouse.click(box["x"] + box["width"] * x, box["y"] + box["height"] * y)
        while frame.evaluate("window.clicks.length") < number:
            page.wait_for_timeout(10)
        page.keyboard.press("Escape")
        page.wait_for_timeout(400)
    return [took for took, _ in frame.evaluate("window.clicks")]


def measure(db: Path) -> dict[str, float]:
    """Open the pair three ways, and click on it."""
    figures: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as cache:
        os.environ["XDG_CACHE_HOME"] = cache
        with serve(db) as url, desk(url) as (page, frame):
            figures["open_first_s"] = took_s(frame)
            figures["open_again_s"] = opened_s(frame)
        for name in SEGMENTERS:
            with serve(db, "--click", name) as url, desk(url) as (page, frame):
                figures.setdefault("open_kept_s", took_s(frame))
                wait_shown(frame)
                times = click_times(page, frame)
                figures[f"click_p50_ms_{name}"] = float(np.percentile(times, 50))
                figures[f"click_p95_ms_{name}"] = float(np.percentile(times, 95))
    return figures


def took_s(frame: Frame) -> float:
    """Return the seconds from the request for the pair to its last picture."""
    return float(frame.evaluate(TOOK)) / 1e3


def main() -> None:
    """Measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--db", type=Path, default=DEMO)
    parser.add_argument("--large", type=Path, help="a database of one large pair")
    parser.add_argument("--json", action="store_true", help="one JSON object")
    given = parser.parse_args()
    with (
        nullcontext(given.large) if given.large else enlarged(given.db) as large,
        copied(large) as db,
    ):
        figures = measure(db)
    if given.json:
        print(json.dumps(figures))
        return
    for name, value in figures.items():
        limit = next((LIMITS[key] for key in LIMITS if name.startswith(key)), None)
        mark = "" if limit is None or value <= limit else "  over the limit"
        print(f"{name:28} {value:8.2f}{'' if limit is None else f'   limit {limit:g}'}{mark}")


if __name__ == "__main__":
    main()
