"""The hand of a scripted annotator: real mouse and keys, and a count of them."""

from __future__ import annotations

import math

from planner import Plan, Step
from playwright.sync_api import Frame, Page

ZOOM_RATE = 0.0015
LARGEST_SCALE = 12.0
LIVE_PANE = 1


class Hand:
    """Draws on the live pane of an open pair; knows where the view is."""

    def __init__(self, page: Page, frame: Frame) -> None:
        self.page = page
        self.frame = frame
        self.actions = 0
        self.tool = ""
        self.begin()

    def begin(self) -> None:
        """A pair was opened: everything is fitted."""
        self.frame.evaluate("document.activeElement.blur()")
        self.page.keyboard.press("f")
        self._fitted()

    def carry_out(self, plan: Plan) -> None:
        """Do the steps of a plan."""
        if plan.near is not None:
            self._zoom(plan.near)
        for step in plan.steps:
            self._do(step)
        if plan.near is not None:
            self.key("f")
            self._fitted()

    def key(self, key: str) -> None:
        """Press a key."""
        self.page.keyboard.press(key)
        self.actions += 1

    def _do(self, step: Step) -> None:
        if step.kind == "tool":
            self._choose(step.key)
        elif step.kind == "key":
            self.key(step.key)
        elif step.kind == "radius":
            # The slider takes arrow keys; a person drags it: one action.
            self.frame.fill("#radius", str(step.x))
            self.frame.evaluate("document.activeElement.blur()")
            self.actions += 1
        elif step.kind == "away-box":
            self._drag_away(step.box)
        else:
            if step.kind == "away-click":
                self.page.keyboard.down("Alt")
            button = "right" if step.kind == "right" else "left"
            x, y = self._place((step.x, step.y))
            self.page.mouse.move(x, y)
            self.page.mouse.click(x, y, button=button)
            self.page.keyboard.up("Alt")
            self.actions += 1
            if step.settle:
                self._wait_for_click()

    def _wait_for_click(self) -> None:
        """Wait until the newest click is answered."""
        self.frame.wait_for_selector("body:not([data-asking])", timeout=20_000)

    def _choose(self, key: str) -> None:
        if self.tool != key:
            self.key(key)
            self.tool = key

    def _drag_away(self, box: tuple[int, int, int, int]) -> None:
        x0, y0, x1, y1 = box
        self.page.keyboard.down("Alt")
        self._drag((x0 - 0.4, y0 - 0.4), (x1 + 0.4, y1 + 0.4))
        self.page.keyboard.up("Alt")

    def _drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        self.page.mouse.move(*self._place(start))
        self.page.mouse.down()
        self.page.mouse.move(*self._place(end), steps=3)
        self.page.mouse.up()
        self.actions += 1

    def _fitted(self) -> None:
        box = self.frame.locator(".pane canvas").nth(LIVE_PANE).bounding_box()
        assert box is not None
        self.box = box
        self.page.wait_for_timeout(40)
        self._look()

    def _place(self, point: tuple[float, float]) -> tuple[float, float]:
        x = self.box["x"] + self.box["width"] / 2 + (point[0] - self.middle[0]) * self.scale
        y = self.box["y"] + self.box["height"] / 2 + (point[1] - self.middle[1]) * self.scale
        return x, y

    def _zoom(self, box: tuple[int, int, int, int]) -> None:
        """Turn the wheel over the middle of a box until it fills a good part of the pane."""
        x0, y0, x1, y1 = box
        target = ((x0 + x1) / 2, (y0 + y1) / 2)
        side = 2.5 * max(x1 - x0, y1 - y0, 12)
        wanted = min(LARGEST_SCALE, min(self.box["width"], self.box["height"]) / side)
        x, y = (round(v) for v in self._place(target))
        turn = round(-math.log(wanted / self.scale) / ZOOM_RATE)
        self.page.mouse.move(x, y)
        self.page.mouse.wheel(0, turn)
        self.page.wait_for_timeout(60)
        self.actions += 1
        self._look()

    def _look(self) -> None:
        """Read where the view is."""
        scale, x, y = (self.frame.get_attribute("#panes", "data-view") or "").split()
        self.scale, self.middle = float(scale), (float(x), float(y))
