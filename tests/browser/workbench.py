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


def choose(frame, field, value):
    """Set a field of the menu, and shut the menu."""
    frame.click("#more > summary")
    frame.select_option(field, value)
    frame.locator("#title").click()
    expect(frame.locator("#more")).not_to_have_attribute("open", "")


def widen_drawer(page, by):
    """Drag the right edge of the drawer."""
    box = page.locator('[data-dock-region-resize="left"]').bounding_box()
    x, y = box["x"] + 3, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + by, y, steps=5)
    page.mouse.up()
    page.wait_for_timeout(400)


SIX_LAYERS = ["warped", "live", "detector", "objects_live", "doi", "prediction"]


def show_layers(frame, layers):
    """Show as many panes, with these layers."""
    choose(frame, "#pane-count", str(len(layers)))
    for index, layer in enumerate(layers):
        frame.locator(".pane select").nth(index).select_option(layer)


def press_in_menu(frame, action, menu="#more"):
    """Press a button of a menu."""
    frame.click(f"{menu} > summary")
    frame.click(f"{menu} button[data-action={action}]")


def wait_title(frame, text):
    expect(frame.locator("#title")).to_have_text(text)


def wait_saved(frame, revision):
    expect(frame.locator("#facts")).to_contain_text(re.compile(rf"revision {revision}\b"))
    expect(frame.locator("#save")).to_have_attribute("data-status", "saved")


def wait_proposals(frame):
    expect(frame.locator("#proposal-list li")).not_to_have_count(0)


def live_place(frame, point, pane=1):
    """Where an image point lies on the page, in the live pane (the second) while all is fitted."""
    box = frame.locator(".pane canvas").nth(pane).bounding_box()
    scale = min(box["width"] / 160, box["height"] / 120)
    x, y = point
    return (
        box["x"] + box["width"] / 2 + (x - 80) * scale,
        box["y"] + box["height"] / 2 + (y - 60) * scale,
    )


def on_live(frame, page, points, pane=1):
    """Drag over the live pane, or another, through image points."""
    places = [live_place(frame, point, pane) for point in points]
    page.mouse.move(*places[0])
    page.mouse.down()
    for place in places[1:]:
        page.mouse.move(*place, steps=6)
    page.mouse.up()


def reload(frame):
    """Load the frame again, and wait until it shows its pair."""
    frame.evaluate("document.body.dataset.old = 'yes'; location.reload()")
    frame.wait_for_selector("body:not([data-old])")
    expect(frame.locator("#title")).not_to_have_text("…")
