"""A served database and a signed-in workbench inside the Viser page, as people use it."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Frame, Page, expect, sync_playwright

ROOT = Path(__file__).resolve().parent.parent
DEMO = ROOT / "demo-data/world-7-4/reviewer.db"
TOKEN = "benchmark-token"

sys.path.insert(0, str(ROOT / "tests"))
from find_browser import FLAGS, find_browser  # noqa: E402


@contextmanager
def serve(db: Path, *options: str) -> Iterator[str]:
    """Run `reviewer serve` on a database; the address it listens on."""
    command = [sys.executable, "-u", "-c", "from reviewer.cli import main; main()", "serve"]
    given = ["--db", str(db), "--port", "0", "--token", TOKEN, *options]
    with subprocess.Popen([*command, *given], stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            yield server.stdout.readline().split()[-1].partition("/sign-in")[0]
        finally:
            server.terminate()


@contextmanager
def desk(url: str, name: str = "Benchmark") -> Iterator[tuple[Page, Frame]]:
    """Sign in and wait for the workbench to show its first pair."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_browser(), args=FLAGS)
        page = browser.new_page(viewport={"width": 1600, "height": 950})
        page.goto(f"{url}/sign-in#token={TOKEN}")
        page.fill("input[name=name]", name)
        page.click("text=Sign in")
        element = page.wait_for_selector("iframe.workbench-frame", timeout=60_000)
        frame = element.content_frame() if element else None
        assert frame is not None
        expect(frame.locator("#title")).not_to_have_text("…", timeout=60_000)
        wait_shown(frame)
        frame.click("#tour-skip")
        page.wait_for_timeout(1500)
        yield page, frame
        browser.close()


def wait_shown(frame: Frame, pair: int | None = None) -> None:
    """Wait until all pictures of a pair (or of any) are on the screen."""
    wanted = f'="{pair}"' if pair else ':not([data-shown=""])'
    selector = f"#panes[data-shown{wanted}]" if pair else f"#panes[data-shown]{wanted}"
    frame.wait_for_selector(selector, timeout=120_000)


def wait_saved(frame: Frame, timeout_s: float = 30.0) -> None:
    """Wait until nothing is unsent."""
    end = time.monotonic() + timeout_s
    while frame.get_attribute("#save", "data-status") != "saved":
        if time.monotonic() > end:
            raise TimeoutError(frame.inner_text("#save"))
        frame.wait_for_timeout(5)
