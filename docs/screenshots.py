"""Take the pictures of the README from the running demo: `reviewer demo` first, then this.

Usage: python docs/screenshots.py http://127.0.0.1:8000 TOKEN
"""

import sys
from pathlib import Path

from playwright.sync_api import Frame, Page, expect, sync_playwright

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))
from find_browser import FLAGS, find_browser  # noqa: E402

PAIR = "lr2/0000"


def open_pair(page: Page, frame: Frame, wanted: str) -> None:
    """Walk the queue to a pair."""
    title = frame.locator("#title")
    for _ in range(200):
        now = title.inner_text()
        if now == wanted:
            return
        frame.locator("button[data-action=next]").click()
        expect(title).not_to_have_text(now)
    sys.exit(f"{wanted} is not in the queue")


def click_object(page: Page, frame: Frame) -> None:
    """Look closely at the first region, and click into the middle of the live pane."""
    page.mouse.move(*middle(frame))
    page.keyboard.press("Tab")
    page.wait_for_timeout(800)
    page.keyboard.press("c")
    page.mouse.click(*middle(frame))
    expect(frame.locator("#facts")).to_contain_text("candidate")


def middle(frame: Frame) -> tuple[float, float]:
    """Return the middle of the live pane on the page."""
    box = frame.locator(".pane canvas").nth(1).bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def main() -> None:
    """Visit the desk and photograph it: dark, light, and with a clicked object."""
    url, token = sys.argv[1:3]
    target = ROOT / "docs" / "images"
    target.mkdir(exist_ok=True)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_browser(), args=FLAGS)
        page = browser.new_page(viewport={"width": 1680, "height": 980})
        page.goto(f"{url}/sign-in?token={token}")
        page.fill("input[name=name]", "Ada")
        page.click("text=Sign in")
        frame = page.wait_for_selector("iframe.workbench-frame", timeout=60_000).content_frame()
        expect(frame.locator("#title")).not_to_have_text("…", timeout=60_000)
        toast = page.locator(".mantine-Notification-closeButton").first
        toast.click(timeout=5000)
        open_pair(page, frame, PAIR)
        page.wait_for_timeout(2500)
        page.screenshot(path=target / "desk-dark.png")
        frame.locator("button[data-action=theme]").click()
        page.wait_for_timeout(2000)
        page.screenshot(path=target / "desk-light.png")
        frame.locator("button[data-action=theme]").click()
        click_object(page, frame)
        page.wait_for_timeout(1500)
        page.screenshot(path=target / "desk-click.png")
        page.keyboard.press("Escape")
        browser.close()


if __name__ == "__main__":
    main()
