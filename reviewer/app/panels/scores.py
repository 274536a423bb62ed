"""Scores in Viser: mean F under both scopes, a table by split, and the whole report to download.

Everything but the report comes from stored counts, so another protocol is there at once.
"""

from __future__ import annotations

import html
from typing import Any

import viser

from reviewer.app.desks import Desk
from reviewer.errors import ReviewerError
from reviewer.evaluation.basis import TITLES, truth_basis
from reviewer.evaluation.counting import refresh_counts
from reviewer.evaluation.protocols import Protocol, protocol_lines
from reviewer.evaluation.table_a import table_a_rows
from reviewer.evaluation.tables import DASH, MEAN, short_row, unseen_text
from reviewer.extras import telling_what_is_missing
from reviewer.reports.table_a_text import scope_rows
from reviewer.store.scores import pair_scores
from reviewer.words import EmptyRule, LineGroup, ProtocolKind, Standing

KINDS: dict[str, ProtocolKind] = {
    "pixels pooled": "pooled",
    "mean F of images": "image_mean",
    "F of mean P and R": "mean_pr",
}
GROUPS: dict[str, LineGroup] = {"split": "split", "workspace": "workspace", "object group": "group"}
ALL = "all that counts"
EMPTIES: dict[str, EmptyRule] = {"left out": "skip", "1": "one", "0": "zero"}


class ScoresPanel:
    """The tab of one Viser client; filled on demand."""

    def __init__(self, client: viser.ClientHandle, desk: Desk, panel: viser.PanelHandle) -> None:
        """Build the widgets beside the workbench."""
        self._client, self._desk = client, desk
        gui = client.gui
        with panel.add_tab("Scores"):
            start = gui.add_button("Count")
            self._kind = gui.add_dropdown("Protocol", tuple(KINDS))
            self._group = gui.add_dropdown("One row per", tuple(GROUPS))
            self._empty = gui.add_dropdown(
                "Empty images",
                tuple(EMPTIES),
                hint="How an image without change counts when nothing was found in it",
            )
            self._state = gui.add_dropdown(
                "Ground truth",
                (ALL, *TITLES.values()),
                hint="Unfinished masks are never scored",
            )
            self._text = gui.add_html("")
            self._report = gui.add_button("Report as one HTML page", visible=False)
        start.on_click(lambda _: self.draw())
        for widget in (self._kind, self._group, self._empty, self._state):
            widget.on_update(lambda _: self.draw())
        self._report.on_click(lambda _: self._download())

    def _protocol(self) -> Protocol:
        return Protocol(
            KINDS[self._kind.value],
            EMPTIES[self._empty.value],
            group=GROUPS[self._group.value],
        )

    def _standings(self) -> tuple[Standing, ...]:
        return tuple(standing for standing, title in TITLES.items() if title == self._state.value)

    def draw(self) -> None:
        """Update the counts, and show all runs."""
        store, run = self._desk.store, self._desk.chosen_run
        refresh_counts(store)
        standings, protocol = self._standings(), self._protocol()
        scores = pair_scores(store, None, standings)
        lines = protocol_lines(scores, protocol)
        self._report.visible = bool(lines)
        basis = _line(f"Scored against the {html.escape(truth_basis(store, standings))}.")
        if not lines or run is None:
            self._text.content = basis + _line(
                "No run has a prediction of a pair with such a ground truth."
            )
            return
        means = _table(scope_rows(table_a_rows(store, scores, protocol)))
        own = [line for line in lines if line.run == run.name]
        if not own:
            missing = f"Run {html.escape(run.name)} has no prediction of a pair with ground truth."
            self._text.content = basis + _line("<b>Mean F</b>") + means + _line(missing)
            return
        one = [line for line in own if line.method == own[0].method and line.split != MEAN]
        ignored = sum(line.counts.ignored for line in one)
        shown = f"<b>{html.escape(run.name)}</b>, scope {run.settings['scope']}"
        self._text.content = (
            basis
            + _line("<b>Mean F</b>")
            + means
            + _line(f"{shown}; {ignored:,} ill-posed pixels are left out")
            + _line(f"{unseen_text(own[-1].counts)}.")
            + _table([short_row(line, self._group.value) for line in own])
        )

    def _download(self) -> None:
        self._report.label = "Writing the report…"
        try:
            with telling_what_is_missing("report"):
                from reviewer.reports.page import report_page
            page = report_page(
                self._desk.store, None, self._protocol(), lambda step: None, self._standings()
            )
            self._client.send_file_download("report.html", page.encode(), save_immediately=True)
        except ReviewerError as error:
            self._client.add_notification("No report", str(error), color="red")
        finally:
            self._report.label = "Report as one HTML page"


def _table(rows: list[dict[str, Any]]) -> str:
    head = "".join(f'<th style="text-align:left">{html.escape(key)}</th>' for key in rows[0])
    body = "".join(
        f'<tr style="{"font-weight:650" if MEAN in row.values() else ""}">'
        + "".join(f"<td>{_short(value)}</td>" for value in row.values())
        + "</tr>"
        for row in rows
    )
    return (
        '<table style="margin:0 .75em;font-size:.85em;border-spacing:1.2em .1em;'
        f'font-variant-numeric:tabular-nums"><tr>{head}</tr>{body}</table>'
    )


def _short(value: Any) -> str:
    if value is None:
        return DASH
    return f"{value:.4f}" if isinstance(value, float) else html.escape(str(value))


def _line(text: str) -> str:
    return f'<div style="padding:.6em .75em .2em;font-size:.85em">{text}</div>'
