"""Measure the review desk in a real Chromium: the brush, the next pair, the save.

Needs a demo database (`reviewer demo --check`). Prints p50 and p95 of each; `--json` one object.
Painting is timed in the page from the pointer event to the end of the frame that shows it.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from playwright.sync_api import Frame, Page, expect, sync_playwright

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))
from find_browser import FLAGS, find_browser  # noqa: E402

TOKEN = "benchmark-token"
LIMITS = {"brush_ms": 16.7, "next_pair_ms": 100.0, "save_ms": 50.0}

WATCH = """() => {
    window.brush = [];
    window.saves = [];
    window.addEventListener("pointermove", (event) => {
        const start = performance.now();
        requestAnimationFrame(() => setTimeout(() => window.brush.push(performance.now() - start)));
    }, true);
    const own = window.fetch;
    window.fetch = async (...call) => {
        const start = performance.now();
        const reply = await own(...call);
        if (call[1]?.method === "PUT") window.saves.push(performance.now() - start);
        return reply;
    };
}"""


def drag(page: Page, frame: Frame, row: float) -> None:
    """Draw one stroke over the live pane."""
    box = frame.locator(".pane canvas").nth(1).bounding_box()
    assert box is not None
    y = box["y"] + box["height"] * row
    page.mouse.move(box["x"] + box["width"] * 0.2, y)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.8, y + 20, steps=40)
    page.mouse.up()


def next_pair_ms(frame: Frame) -> float:
    """Time from "next" to the frame in which all panes of the next pair are drawn."""
    return float(
        frame.evaluate(
            """async () => {
                const title = document.getElementById("title");
                const before = title.textContent;
                const start = performance.now();
                document.querySelector("button[data-action=next]").click();
                while (title.textContent === before) await new Promise(requestAnimationFrame);
                await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
                return performance.now() - start;
            }"""
        )
    )


def measure(url: str) -> dict[str, list[float]]:
    """Return the samples of each figure, milliseconds."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_browser(), args=FLAGS)
        page = browser.new_page(viewport={"width": 1600, "height": 950})
        page.goto(f"{url}/sign-in?token={TOKEN}")
        page.fill("input[name=name]", "Benchmark")
        page.click("text=Sign in")
        page.wait_for_url(f"{url}/")
        page.goto(f"{url}/workbench")
        frame = page.main_frame
        expect(frame.locator("#title")).not_to_have_text("…", timeout=60_000)
        page.wait_for_timeout(1500)
        frame.evaluate(WATCH)
        for k in range(12):
            drag(page, frame, 0.15 + 0.05 * k)
            page.wait_for_timeout(150)
        samples = {"brush_ms": frame.evaluate("window.brush")}
        samples["save_ms"] = frame.evaluate("window.saves")
        samples["next_pair_ms"] = []
        for _ in range(30):
            samples["next_pair_ms"].append(next_pair_ms(frame))
            page.wait_for_timeout(700)
        browser.close()
    return samples


def main() -> None:
    """Serve the database, visit it, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--db", type=Path, default=ROOT / "demo-data/world-7-4/reviewer.db")
    parser.add_argument("--json", action="store_true", help="one JSON object")
    arguments = parser.parse_args()
    command = [sys.executable, "-u", "-c", "from reviewer.cli import main; main()", "serve"]
    options = ["--db", str(arguments.db), "--port", "0", "--token", TOKEN]
    with subprocess.Popen([*command, *options], stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            url = server.stdout.readline().split()[-1].partition("/sign-in")[0]
            time.sleep(0.5)
            samples = measure(url)
        finally:
            server.terminate()
    figures = {
        f"{name}_{label}": float(np.percentile(values, share))
        for name, values in samples.items()
        for label, share in (("p50", 50), ("p95", 95))
    }
    if arguments.json:
        print(json.dumps(figures))
        return
    for name, limit in LIMITS.items():
        p50, p95 = figures[f"{name}_p50"], figures[f"{name}_p95"]
        mark = "" if p95 <= limit else "  over the limit"
        print(f"{name:14} p50 {p50:7.1f}   p95 {p95:7.1f}   limit {limit:g}{mark}")


if __name__ == "__main__":
    main()
