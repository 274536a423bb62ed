"""The queue in Viser: filters, progress, a page of pairs, previous and next.

Widgets are drawn from the desk's state; what they report goes to the desk, which redraws them.
"""

from __future__ import annotations

import html
from typing import Any

import viser

from reviewer.app.desks import Desk
from reviewer.store.queue import ORDERS, QueueEntry, list_progress
from reviewer.store.runs import list_runs
from reviewer.words import PairState, QueueOrder, TeamState

ROWS = 14
ALL = "all"
STATE_TITLE: dict[PairState, str] = {
    "todo": "to do",
    "in_progress": "in progress",
    "submitted": "submitted",
    "approved": "approved",
    "confirmed_empty": "confirmed empty",
    "skipped": "skipped",
}
TEAM_TITLE: dict[TeamState, str] = {
    "todo": "nobody has begun",
    "in_progress": "somebody is at it",
    "waiting": "waiting for review",
    "approved": "approved",
    "changed": "changed since approved",
}
TEAM_SHORT: dict[TeamState, str] = {
    "waiting": "to review",
    "approved": "approved",
    "changed": "changed",
}
ORDER_TITLE: dict[QueueOrder, str] = {
    "name": "name",
    "doi": "highest DoI",
    "size": "largest change",
    "unreviewed": "unreviewed first",
    "doubt": "in doubt first",
}
STATE_COLOUR: dict[PairState, tuple[int, int, int]] = {
    "todo": (134, 142, 150),
    "in_progress": (230, 150, 30),
    "submitted": (60, 140, 220),
    "approved": (32, 160, 110),
    "confirmed_empty": (120, 110, 200),
    "skipped": (150, 110, 80),
}
STATE_SIGN: dict[PairState, str] = {
    "todo": "○",
    "in_progress": "◐",
    "submitted": "●",
    "approved": "✓",
    "confirmed_empty": "∅",
    "skipped": "⊘",
}


class QueuePanel:
    """The docked panel of one Viser client."""

    def __init__(self, client: viser.ClientHandle, desk: Desk) -> None:
        """Build the widgets; `draw` fills them."""
        self._desk = desk
        self._page = 0
        self._shown: list[QueueEntry] = []
        self._run: viser.GuiDropdownHandle[str] | None = None
        self.panel = client.gui.add_panel()
        with self.panel.add_tab("Queue"):
            self._build_filters(client.gui)
            self._build_rows(client.gui)
        with self.panel.add_tab("Progress"):
            self._progress = client.gui.add_html("")

    def _build_filters(self, gui: viser.GuiApi) -> None:
        desk = self._desk
        splits = [ALL, *(p.split for p in list_progress(desk.store, desk.annotator_id))]
        runs = [run.name for run in list_runs(desk.store)]
        self._summary = gui.add_html("")
        split = gui.add_dropdown("Split", splits, initial_value=desk.split or ALL)
        states = [ALL, *STATE_TITLE.values()]
        shown = STATE_TITLE[desk.state] if desk.state else ALL
        state = gui.add_dropdown("My state", states, initial_value=shown)
        teams = [ALL, *TEAM_TITLE.values()]
        shown = TEAM_TITLE[desk.team] if desk.team else ALL
        team = gui.add_dropdown("Team", teams, initial_value=shown)
        orders = list(ORDER_TITLE.values())
        order = gui.add_dropdown("Order", orders, initial_value=ORDER_TITLE[desk.order])

        @split.on_update
        def _(_: Any) -> None:
            self._page = 0
            desk.filter(split=None if split.value == ALL else split.value)

        @state.on_update
        def _(_: Any) -> None:
            self._page = 0
            chosen = next((k for k, title in STATE_TITLE.items() if title == state.value), None)
            desk.filter(state=chosen)

        @team.on_update
        def _(_: Any) -> None:
            self._page = 0
            chosen = next((k for k, title in TEAM_TITLE.items() if title == team.value), None)
            desk.filter(team=chosen)

        @order.on_update
        def _(_: Any) -> None:
            self._page = 0
            chosen = next(k for k, title in ORDER_TITLE.items() if title == order.value)
            assert chosen in ORDERS
            desk.filter(order=chosen)

        if len(runs) > 1:
            self._run = gui.add_dropdown("Run", runs, initial_value=desk.run or runs[-1])
            chosen_run = self._run

            @chosen_run.on_update
            def _(_: Any) -> None:
                if chosen_run.value != desk.run:
                    desk.filter(run=chosen_run.value)

    def _build_rows(self, gui: viser.GuiApi) -> None:
        desk = self._desk
        self._rows = [gui.add_button(" ", visible=False) for _ in range(ROWS)]
        for place, row in enumerate(self._rows):

            @row.on_click
            def _(_: Any, place: int = place) -> None:
                if place < len(self._shown):
                    desk.open_pair(self._shown[place].id)

        pages = gui.add_button_group("Page", ("‹", "›"))

        @pages.on_click
        def _(_: Any) -> None:
            self._page += 1 if pages.value == "›" else -1
            self.draw(follow=False)

        steps = gui.add_button_group("Pair", ("previous", "next"))

        @steps.on_click
        def _(_: Any) -> None:
            desk.step(1 if steps.value == "next" else -1)

    def draw(self, *, follow: bool = True) -> None:
        """Fill the widgets from the desk; `follow` shows the page of the open pair."""
        desk = self._desk
        with desk.lock:
            ids, open_id = desk.ids, desk.pair_id
            last = max(0, (len(ids) - 1) // ROWS)
            if follow and open_id in ids:
                self._page = ids.index(open_id) // ROWS
            self._page = min(max(self._page, 0), last)
            self._shown = desk.entries(ids[self._page * ROWS : (self._page + 1) * ROWS])
            for place, row in enumerate(self._rows):
                row.visible = place < len(self._shown)
                if place < len(self._shown):
                    entry = self._shown[place]
                    row.label = _row_label(entry)
                    # Viser takes None for the theme's own colour, which marks the open pair.
                    mine = entry.id == open_id
                    row.color = None if mine else _row_colour(entry, dark=desk.dark)
            if self._run is not None and desk.run:
                self._run.value = desk.run  # type: ignore[misc]  # settable on the concrete handle
            self._summary.content = _summary(desk, len(ids), self._page, last)
            self._progress.content = _progress(desk)


def _row_label(entry: QueueEntry) -> str:
    doi = "" if entry.max_doi is None else f"  ·  DoI {entry.max_doi:.2f}"
    doubt = "  ⚠" if entry.doubt else ""
    # What the team says of a pair matters where it is more than one's own sign tells.
    told = entry.team in ("todo", "in_progress") or entry.team == entry.state
    team = "" if told else f"  ·  {TEAM_SHORT[entry.team]}"
    return f"{STATE_SIGN[entry.state]}  {entry.split}/{entry.name}{team}{doi}{doubt}"


def _row_colour(entry: QueueEntry, *, dark: bool) -> tuple[int, int, int]:
    if entry.state == "todo":
        return (46, 51, 60) if dark else (226, 230, 235)
    return STATE_COLOUR[entry.state]


def _summary(desk: Desk, count: int, page: int, last: int) -> str:
    name = html.escape(desk.annotator or "")
    narrowed = "" if desk.only is None else " that change sides"
    legend = "".join(
        f'<span style="white-space:nowrap;margin-right:.7em">{STATE_SIGN[state]} {title}</span> '
        for state, title in STATE_TITLE.items()
    )
    return (
        '<div style="padding:.5em .75em .6em;font-size:.8em;line-height:1.7">'
        f"<b>{count}</b> pairs{narrowed} &middot; page {page + 1} of {last + 1} &middot; {name}<br>"
        f'<span style="opacity:.75">{legend}'
        '<span style="white-space:nowrap">⚠ in doubt, or failed</span></span></div>'
    )


def _progress(desk: Desk) -> str:
    rows = []
    for item in list_progress(desk.store, desk.annotator_id):
        share = 100 * item.finished / max(item.pairs, 1)
        rows.append(
            f'<div style="display:flex;align-items:center;gap:.6em;margin:.45em 0">'
            f'<span style="width:2.6em">{html.escape(item.split)}</span>'
            '<span style="flex:1;height:.5em;border-radius:.25em;background:rgba(128,128,128,.25)">'
            f'<span style="display:block;height:100%;width:{share:.1f}%;border-radius:.25em;'
            'background:rgb(32,160,110)"></span></span>'
            f'<span style="width:4em;text-align:right;font-variant-numeric:tabular-nums">'
            f"{item.finished}/{item.pairs}</span></div>"
        )
    return f'<div style="padding:.5em .75em;font-size:.85em">{"".join(rows)}</div>'
