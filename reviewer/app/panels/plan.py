"""Active inspection in Viser: a tour of views drawn on the map, and its files to download."""

from __future__ import annotations

import html
from typing import Any

import numpy as np
import viser

from reviewer.app.desks import Desk
from reviewer.errors import ReviewerError
from reviewer.geometry import FloorCamera
from reviewer.inspection.planning import (
    DEFAULT_CAMERA,
    InspectionPlan,
    PlanSettings,
    plan_inspection,
)
from reviewer.inspection.views import ViewSettings
from reviewer.inspection.writing import FORMATS
from reviewer.store.pairs import pair_of_id

TARGET, UNSEEN, WAY = (255, 64, 90), (150, 156, 165), (20, 150, 160)
LIFT = 0.06
ROWS = 12


class PlanPanel:
    """The tab of one Viser client, and its layer of the map."""

    def __init__(self, client: viser.ClientHandle, desk: Desk, panel: viser.PanelHandle) -> None:
        """Build the widgets in a tab of the queue's panel."""
        self._client, self._desk = client, desk
        self._plan: InspectionPlan | None = None
        self._shown: tuple[str, str] | None = None
        self._nodes: list[Any] = []
        gui = client.gui
        with panel.add_tab("Plan"):
            gui.add_html(_line("Where should the robot look again, and from where?"))
            self._budget = gui.add_slider("Length of the tour, m", 1.0, 80.0, 1.0, 20.0)
            self._stand_off = gui.add_slider("Distance of a view, m", 0.5, 2.5, 0.1, 1.0)
            with gui.add_folder("Camera", expand_by_default=False):
                self._height = gui.add_number("Height, m", DEFAULT_CAMERA.height, min=0.05)
                self._pitch = gui.add_number("Pitch, rad", DEFAULT_CAMERA.pitch)
                self._focal = gui.add_number("Focal, px", DEFAULT_CAMERA.focal, min=10.0)
            start = gui.add_button("Plan this split")
            self._text = gui.add_html("")
            self._files = gui.add_button_group("Download", tuple(FORMATS), visible=False)
            self._clear = gui.add_button("Clear the map", visible=False)
        start.on_click(lambda _: self.make())
        self._files.on_click(lambda _: self._download())
        self._clear.on_click(lambda _: self.forget())

    def _here(self) -> tuple[str, str] | None:
        """The split of the open pair, and the run."""
        desk = self._desk
        run = desk.chosen_run
        if run is None or desk.pair_id is None:
            return None
        return pair_of_id(desk.store, desk.pair_id).split, run.name

    def make(self) -> None:
        """Plan the split of the open pair, and draw it."""
        desk = self._desk
        with desk.lock:
            here, run = self._here(), desk.chosen_run
            if here is None or run is None or desk.pair_id is None:
                self._text.content = _line("There is no run yet.")
                return
            live = pair_of_id(desk.store, desk.pair_id).live
            camera = FloorCamera(
                self._height.value, self._pitch.value, self._focal.value, live.height, live.width
            )
            views = ViewSettings(stand_off=self._stand_off.value)
            settings = PlanSettings(camera, views, self._budget.value)
            self.forget()
            self._text.content = _line("Planning…")
        # Seconds on a large map, during which the desk goes on.
        try:
            plan = plan_inspection(desk.store, run, here[0], settings)
        except ReviewerError as error:
            self._text.content = _line(html.escape(str(error)))
            return
        with desk.lock:
            if self._here() != here:
                return
            self.forget()
            self._plan, self._shown = plan, here
            self._text.content = _table(self._plan)
            self._files.visible = self._clear.visible = True
            self._draw(self._plan)

    def forget(self) -> None:
        """Take the plan off the map."""
        with self._desk.lock:
            for node in self._nodes:
                node.remove()
            self._nodes = []
            self._plan = self._shown = None
            self._text.content = ""
            self._files.visible = self._clear.visible = False

    def follow(self) -> None:
        """Forget a plan of another split or run; the scene of another split has lost it already."""
        if self._shown is None:
            return
        here = self._here()
        if here != self._shown:
            if here is None or here[0] != self._shown[0]:
                self._nodes = []
            self.forget()

    def _draw(self, plan: InspectionPlan) -> None:
        scene, views = self._client.scene, plan.tour.views
        targets = [(v.target.x, v.target.y, max(v.target.heights[1], LIFT)) for v in views]
        left = [(t.target.x, t.target.y, LIFT) for t in plan.tour.left_out]
        left += [(x, y, LIFT) for x, y in plan.unseen]
        for name, points, colour in (("targets", targets, TARGET), ("unseen", left, UNSEEN)):
            if points:
                self._nodes.append(
                    scene.add_point_cloud(
                        f"/plan/{name}", np.array(points, np.float32), colour,
                        point_size=0.13, point_shape="circle",
                    )
                )  # fmt: skip
        if not views:
            return
        arrows = []
        for view, target in zip(views, targets, strict=True):
            here = np.array([view.pose.x, view.pose.y, LIFT])
            there = np.array([target[0], target[1], LIFT])
            reach = 0.45 / max(float(np.linalg.norm(there - here)), 0.01)
            arrows.append([here, here + reach * (there - here)])
        self._nodes.append(
            scene.add_arrows(
                "/plan/views", np.array(arrows, np.float32), WAY,
                shaft_radius=0.03, head_radius=0.09, head_length=0.16,
            )
        )  # fmt: skip
        way = np.array([[x, y, LIFT] for x, y in plan.tour.way], np.float32)
        legs = np.stack([way[:-1], way[1:]], axis=1)
        self._nodes.append(scene.add_line_segments("/plan/way", legs, WAY, thickness=0.035))
        for number, view in enumerate(views, start=1):
            place = (view.pose.x, view.pose.y, LIFT)
            self._nodes.append(scene.add_label(f"/plan/label{number}", str(number), position=place))

    def _download(self) -> None:
        if self._plan is not None:
            ending = self._files.value
            content = FORMATS[ending](self._plan).encode()
            name = f"plan-{self._plan.split}.{ending}"
            self._client.send_file_download(name, content, save_immediately=True)


def _table(plan: InspectionPlan) -> str:
    tour = plan.tour
    placed = sum(region.place is not None for region in plan.to_inspect)
    lines = [
        f"<b>{len(plan.to_inspect)}</b> regions ask for another look, {placed} have a place.",
        f"<b>{len(tour.views)}</b> views in {tour.length:.1f} m. Seen from nowhere:"
        f" {len(plan.unseen)}; beyond the metres: {len(tour.left_out)}.",
    ]
    rows = "".join(
        f"<tr><td>{number}</td><td>{view.pose.x:.1f}, {view.pose.y:.1f}</td>"
        f"<td>{len(view.target.to_inspect)} regions</td></tr>"
        for number, view in enumerate(tour.views[:ROWS], start=1)
    )
    return _line("<br>".join(lines)) + (
        '<table style="margin:0 .75em;font-size:.8em;border-spacing:.9em .1em;'
        f'font-variant-numeric:tabular-nums">{rows}</table>'
    )


def _line(text: str) -> str:
    return f'<div style="padding:.4em .75em;font-size:.8em;line-height:1.5">{text}</div>'
