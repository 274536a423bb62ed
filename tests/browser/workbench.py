"""What several stories do with the workbench frame."""

import re

from playwright.sync_api import Frame, Page, expect


def workbench_of(page: Page) -> Frame:
    """Wait for the workbench inside Viser to show a pair."""
    element = page.wait_for_selector("iframe.workbench-frame", timeout=30_000)
    frame = element.content_frame()
    expect(frame.locator("#title")).not_to_have_text("…", timeout=30_000)
    frame.wait_for_selector(".pane canvas")
    return frame


def wait_title(frame, text):
    expect(frame.locator("#title")).to_have_text(text)


def wait_saved(frame, revision):
    expect(frame.locator("#facts")).to_contain_text(re.compile(rf"revision {revision}\b"))
    expect(frame.locator("#save")).to_have_attribute("data-status", "saved")


def on_live(frame, page, points):
    """Drag over the live pane (the second), through image points."""
    canvas = frame.locator(".pane canvas").nth(1)
    box = canvas.bounding_box()
    scale = min(box["width"] / 160, box["height"] / 120)
    places = [
        (
            box["x"] + box["width"] / 2 + (x - 80) * scale,
            box["y"] + box["height"] / 2 + (y - 60) * scale,
        )
        for x, y in points
    ]
    page.mouse.move(*places[0])
    page.mouse.down()
    for place in places[1:]:
        page.mouse.move(*place, steps=6)
    page.mouse.up()
