"""Take the pictures of README and guide from the running demo: `reviewer demo` first, then this.

Usage: python docs/screenshots.py http://127.0.0.1:8000 TOKEN
"""

import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from playwright.sync_api import Frame, Page, expect, sync_playwright

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))
from find_browser import FLAGS, find_browser  # noqa: E402

TARGET = ROOT / "docs" / "images"
PAIR, PLANNED = "lr2/0000", "cs1/0001"
WEIGHT_FREE = "dis-siamese-lite-object-net-component"


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


def shoot(page: Page, name: str) -> None:
    """Photograph the page; a .jpg takes a fifth of the bytes."""
    page.wait_for_timeout(1800)
    if name.endswith(".png"):
        page.screenshot(path=TARGET / name)
        return
    picture = cv2.imdecode(np.frombuffer(page.screenshot(), np.uint8), cv2.IMREAD_COLOR)
    assert cv2.imwrite(str(TARGET / name), picture, [cv2.IMWRITE_JPEG_QUALITY, 86])


def desk(page: Page, frame: Frame) -> None:
    """Dark, light, and with a clicked object."""
    open_pair(page, frame, PAIR)
    page.wait_for_timeout(1000)
    shoot(page, "desk-dark.png")
    page.keyboard.press("Shift+L")
    shoot(page, "desk-light.png")
    page.keyboard.press("Shift+L")
    click_object(page, frame)
    shoot(page, "desk-click.png")
    page.keyboard.press("Escape")
    page.keyboard.press("b")


def audit(page: Page, frame: Frame) -> None:
    """The walk through regions, with a reason picked."""
    frame.select_option("#mode", "audit")
    frame.select_option("#walkOrder", "loss")
    expect(frame.locator("#walk")).to_contain_text("flipping gains")
    frame.locator("#title").click()
    page.wait_for_timeout(1000)
    page.keyboard.press("7")
    shoot(page, "audit.jpg")
    frame.select_option("#mode", "correct")
    page.keyboard.press("f")


def what_if(page: Page, frame: Frame) -> None:
    """The tab with other rules."""
    page.keyboard.press("Alt+w")
    page.get_by_text("Count what other rules would give").click()
    page.wait_for_timeout(2000)
    shoot(page, "what-if.jpg")


def scores(page: Page, frame: Frame) -> None:
    """The tab with scores."""
    page.keyboard.press("Escape")
    page.keyboard.press("Alt+s")
    page.get_by_role("button", name="Count", exact=True).click()
    shoot(page, "scores.jpg")


def plan(page: Page, frame: Frame) -> None:
    """A tour on the map."""
    page.keyboard.press("Escape")
    frame.click("#more > summary")
    frame.select_option("#run", WEIGHT_FREE)
    frame.locator("#title").click()
    page.wait_for_timeout(1500)
    open_pair(page, frame, PLANNED)
    page.wait_for_timeout(1500)
    page.get_by_role("tab", name="Plan").click()
    page.get_by_text("Plan this split").click()
    page.wait_for_timeout(2500)
    shoot(page, "plan.jpg")


PICTURES: dict[str, Callable[[Page, Frame], None]] = {
    "desk": desk,
    "audit": audit,
    "what-if": what_if,
    "scores": scores,
    "plan": plan,
}


def main() -> None:
    """Visit the desk and photograph it; names after the token take only those pictures."""
    url, token, *wanted = sys.argv[1:]
    TARGET.mkdir(exist_ok=True)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_browser(), args=FLAGS)
        page = browser.new_page(viewport={"width": 1680, "height": 980})
        page.goto(f"{url}/sign-in#token={token}")
        page.fill("input[name=name]", "Ada")
        page.click("text=Sign in")
        frame = page.wait_for_selector("iframe.workbench-frame", timeout=60_000).content_frame()
        expect(frame.locator("#title")).not_to_have_text("…", timeout=60_000)
        frame.click("#tour-skip")
        toast = page.locator(".mantine-Notification-closeButton").first
        toast.click(timeout=5000)
        for name in wanted or PICTURES:
            PICTURES[name](page, frame)
        browser.close()


if __name__ == "__main__":
    main()
