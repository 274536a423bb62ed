"""Find a Chromium for the browser tests, or get one; say how when neither is possible.

Order: $REVIEWER_BROWSER, an installed chromium or chrome, `apt-get install chromium` as root,
`playwright install chromium`.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--use-gl=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
]
"""Flags for a headless Chromium without a GPU that draws WebGL in software."""


def find_browser() -> str | None:
    """Return the path of a browser that is there."""
    named = os.environ.get("REVIEWER_BROWSER")
    if named:
        return named
    for name in NAMES:
        found = shutil.which(name)
        if found:
            return found
    application = Path("/Applications/Google Chrome.app/Contents/MacOS/Google Chrome")
    return str(application) if application.exists() else _from_playwright()


def _from_playwright() -> str | None:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        path = playwright.chromium.executable_path
    return path if path and Path(path).exists() else None


def get_browser() -> str | None:
    """Find a browser, else install one."""
    if find_browser():
        return find_browser()
    if hasattr(os, "geteuid") and os.geteuid() == 0 and shutil.which("apt-get"):
        quiet = {"stdout": subprocess.DEVNULL}
        subprocess.run(["apt-get", "update", "-qq"], check=False, **quiet)
        subprocess.run(["apt-get", "install", "-y", "-qq", "chromium"], check=False, **quiet)
    if not find_browser():
        subprocess.run([sys.executable, "-m", "playwright", "install", "chromium"], check=False)
    return find_browser()


if __name__ == "__main__":
    browser = get_browser()
    if browser is None:
        sys.exit(
            "No browser for the browser tests: install chromium with your package manager, or run"
            " `.venv/bin/playwright install chromium`, or set REVIEWER_BROWSER to one."
        )
    print(f"browser: {browser}")
