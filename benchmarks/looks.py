"""Measure how the desk shares out the screen, and how well it can be read.

Shares are of the whole window at 1600x900: the area of the large panes, without the strip under
them. Contrast is the least of all texts, of workbench and Viser page, in both themes. Shifts are of
the parts of the page when the mode changes, at three sizes of the window.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from browser import desk, serve, wait_shown
from contrast import LEAST_CONTRAST
from playwright.sync_api import Frame, Page

WINDOW = (1600, 900)
SIZES = [(1280, 720), WINDOW, (2560, 1440)]
PANES = """() => [...document.querySelectorAll(".pane")].map((e) => e.getBoundingClientRect())
    .reduce((sum, { width, height }) => sum + width * height, 0)"""
BOXES = """() => [".bar", "#title", "#mode", "#toolbox", "#panes", "#strip", "aside", "#decide",
        ".status"]
    .map((s) => document.querySelector(s).getBoundingClientRect())
    .map(({ x, y, right, bottom }) => [x, y, right, bottom])"""


def looks(db: Path) -> dict[str, float]:
    """Return shares, scale, least contrast and largest shift."""
    with serve(db) as url, desk(url) as (page, frame):
        close = page.locator(".mantine-Notification-closeButton")
        if close.count():
            close.first.click()
        resize(page, WINDOW)
        figures = {"picture_share_1600_drawer": share(frame)}
        figures["scale_1600"] = scale(frame)
        page.keyboard.press("\\")
        page.wait_for_timeout(800)
        figures["picture_share_1600"] = share(frame)
        page.keyboard.press("\\")
        figures["contrast_min"] = min(contrasts(page, frame))
        figures["layout_shift_max_px"] = max(shift(page, frame, size) for size in SIZES)
    return figures


def resize(page: Page, size: tuple[int, int]) -> None:
    """Give the window another size."""
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.wait_for_timeout(1000)


def share(frame: Frame) -> float:
    """Return the share of the window that the large panes have."""
    return float(frame.evaluate(PANES)) / (WINDOW[0] * WINDOW[1])


def scale(frame: Frame) -> float:
    """Return CSS pixels a pixel of the image, as a pair opens."""
    return float((frame.get_attribute("#panes", "data-view") or "").split()[0])


def contrasts(page: Page, frame: Frame) -> list[float]:
    """Return the least contrast of each page in each theme and mode."""
    found = []
    for _ in ("dark", "light"):
        for mode in ("correct", "audit"):
            frame.select_option("#mode", mode)
            page.wait_for_timeout(1500)
            found += [float(at.evaluate(LEAST_CONTRAST)["contrast"]) for at in (page, frame)]
        page.keyboard.press("Shift+L")
        page.wait_for_timeout(800)
    return found


def shift(page: Page, frame: Frame, size: tuple[int, int]) -> float:
    """Return the furthest that a part of the page moves as the mode changes."""
    resize(page, size)
    boxes = []
    for mode in ("correct", "blind", "audit"):
        frame.select_option("#mode", mode)
        page.wait_for_timeout(1000)
        wait_shown(frame)
        boxes.append(np.array(frame.evaluate(BOXES)))
    return float(max(np.abs(box - boxes[0]).max() for box in boxes))
