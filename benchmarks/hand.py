"""The hand of a scripted annotator: real mouse and keys, and a count of them."""

from __future__ import annotations

import math

from planner import Plan, Step
from playwright.sync_api import Frame, Page

ZOOM_RATE = 0.0015
LARGEST_SCALE = 40.0
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
        if plan.near is not None or any(step.kind == "pick" for step in plan.steps):
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
        elif step.kind == "pick":
            self.frame.click(f'#proposal-list [data-proposal="{step.key}"] .top')
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
        self.frame.evaluate(
            "() => new Promise((done) => requestAnimationFrame(() => setTimeout(done)))"
        )
        self._look()

    def _place(self, point: tuple[float, float]) -> tuple[float, float]:
        x = self.box["x"] + self.box["width"] / 2 + (point[0] - self.middle[0]) * self.scale
        y = self.box["y"] + self.box["height"] / 2 + (point[1] - self.middle[1]) * self.scale
        return x, y

    def _zoom(self, box: tuple[int, int, int, int]) -> None:
        """Turn the wheel over the middle of a box until it fills a good part of the pane."""
        x0, y0, x1, y1 = box
        target = ((x0 + x1) / 2, (y0 + y1) / 2)
        side = 1.7 * max(x1 - x0, y1 - y0, 4)
        wanted = min(LARGEST_SCALE, min(self.box["width"], self.box["height"]) / side)
        x, y = (round(v) for v in self._place(target))
        turn = round(-math.log(wanted / self.scale) / ZOOM_RATE)
        self.page.mouse.move(x, y)
        self.page.mouse.wheel(0, turn)
        self._look_again()
        self.actions += 1
        if self._shows(box):
            return
        # What was near the edge of the picture is near the edge still: drag it into the middle.
        self.page.mouse.down(button="middle")
        self.page.mouse.move(
            self.box["x"] + self.box["width"] / 2, self.box["y"] + self.box["height"] / 2
        )
        self.page.mouse.up(button="middle")
        self._look_again()
        self.actions += 1

    def _shows(self, box: tuple[int, int, int, int]) -> bool:
        """Say whether a box lies well inside the pane, clear of its picker."""
        left, top = self._place((box[0], box[1]))
        right, bottom = self._place((box[2], box[3]))
        x, y = self.box["x"], self.box["y"]
        across = x + 4 < left and right < x + self.box["width"] - 4
        return across and y + 30 < top and bottom < y + self.box["height"] - 4

    def _look_again(self) -> None:
        """Wait for the view to move."""
        before = (self.scale, self.middle)
        while (self.scale, self.middle) == before:
            self.page.wait_for_timeout(5)
            self._look()

    def _look(self) -> None:
        """Read where the view is."""
        scale, x, y = (self.frame.get_attribute("#panes", "data-view") or "").split()
        self.scale, self.middle = float(scale), (float(x), float(y))
