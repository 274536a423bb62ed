"""Other DoI rules in Viser: sliders, a live curve of F, and the pairs whose masks change.

Everything after the first look is arithmetic on the integers of `evaluation.terms`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import viser
from viser import uplot

from reviewer.app.desks import Desk
from reviewer.evaluation.counting import detector_counts, refresh_counts
from reviewer.evaluation.outcomes import RunTerms, refresh_terms, run_terms
from reviewer.evaluation.rules import Rule, rule_of_run, vary_rule
from reviewer.evaluation.tables import unseen_text
from reviewer.records import Run
from reviewer.words import SCOPES, SEEN

STEPS = 101
FAINT = "rgba(128,140,155,0.45)"
MEAN, BASE, ORACLE, HERE = "#14828c", "#e8590c", "#7048e8", "#f59f00"
RANGES = {"high": (0.0, 1.01), "low": (0.0, 1.0), "max_overlap_px": (0.0, 300.0)}
TITLES = {
    "high": "adopt where DoI is below",
    "low": "adopt where DoI is above",
    "max_overlap_px": "shared pixels that still count as none",
}


class WhatIfPanel:
    """The tab of one Viser client."""

    def __init__(self, client: viser.ClientHandle, desk: Desk, panel: viser.PanelHandle) -> None:
        """Build the widgets beside the workbench."""
        self._client, self._desk = client, desk
        self._run: Run | None = None
        self._terms: RunTerms | None = None
        self._unseen = ""
        gui = client.gui
        with panel.add_tab("What if"):
            self._note = gui.add_html("")
            start = gui.add_button("Count what other rules would give")
            self._vary = gui.add_dropdown("Curve over", tuple(TITLES), visible=False)
            self._high = gui.add_slider("high", 0.0, 1.01, 0.01, 0.9, visible=False)
            self._low = gui.add_slider("low", 0.0, 1.0, 0.01, 0.0, visible=False)
            self._tolerance = gui.add_slider("max overlap px", 0, 300, 1, 0, visible=False)
            self._scope = gui.add_dropdown("scope", SCOPES, visible=False)
            nothing = (np.zeros(2), np.zeros(2))
            empty = (uplot.Series(label=""), uplot.Series(label=""))
            self._seen = gui.add_dropdown(
                "f_b = 0",
                SEEN,
                visible=False,
                hint="What happens to a region when the reference shows an object there, too",
            )
            # Without this uPlot takes x for seconds since 1970.
            plain = {"x": uplot.Scale(time=False)}
            self._plot = gui.add_uplot(nothing, empty, scales=plain, aspect=2.1, visible=False)
            self._walk = gui.add_button("Queue: the pairs that change sides", visible=False)
            self._all = gui.add_button("Queue: all pairs", visible=False)
        start.on_click(lambda _: self._begin())
        for widget in (self._vary, self._high, self._low, self._tolerance, self._scope, self._seen):
            widget.on_update(lambda _: self.draw())
        self._walk.on_click(lambda _: self._narrow(self._changed()))
        self._all.on_click(lambda _: self._narrow(None))

    @property
    def _widgets(self) -> tuple[Any, ...]:
        sliders = (self._high, self._low, self._tolerance)
        return (self._vary, *sliders, self._scope, self._seen, self._plot, self._walk, self._all)

    def _begin(self) -> None:
        """Update the counts, and show the run's own rule."""
        run = self._desk.chosen_run
        if run is None:
            self._note.content = _line("There is no run yet.")
            return
        self._note.content = _line("Counting…")
        refresh_terms(self._desk.store, run)
        refresh_counts(self._desk.store)
        terms = run_terms(self._desk.store, run)
        if not terms.pair_ids:
            self._note.content = _line("No pair of this run has ground truth.")
            return
        self._run, self._terms = run, terms
        self._unseen = unseen_text(detector_counts(self._desk.store, run.name))
        rule = rule_of_run(run.settings)
        # Settable on the concrete handles.
        self._high.value, self._low.value = rule.high, rule.low  # type: ignore[misc]
        self._tolerance.value, self._scope.value = rule.max_overlap_px, rule.scope  # type: ignore[misc]
        self._seen.value = rule.seen  # type: ignore[misc]
        for widget in self._widgets:
            widget.visible = True
        self.draw()

    def _rule(self) -> Rule:
        assert self._run is not None, "widgets are hidden before there is a run"
        return replace(
            rule_of_run(self._run.settings),
            high=self._high.value,
            low=min(self._low.value, self._high.value),
            max_overlap_px=int(self._tolerance.value),
            scope="image" if self._scope.value == "image" else "component",
            seen="reject" if self._seen.value == "reject" else "keep",
        )

    def forget(self) -> None:
        """Forget the counts: another run was chosen."""
        if self._run is not None and self._desk.chosen_run != self._run:
            self._run = self._terms = None
            self._note.content = ""
            for widget in self._widgets:
                widget.visible = False

    def draw(self) -> None:
        """Draw the curve and the scores of the sliders' rule."""
        if self._terms is None or self._run is None:
            return
        engine, rule = self._terms.whatif, self._rule()
        name = self._vary.value
        values = np.linspace(*RANGES[name], STEPS)
        curve = engine.sweep([vary_rule(rule, name, float(value)) for value in values])
        own = rule_of_run(self._run.settings)
        now, before = engine.sweep([rule, own]).mean_f()
        base = float(engine.base().mean_f()[0])
        oracle = float(engine.oracle(rule.scope, rule.seen).mean_f()[0])
        changed = len(engine.changed_pairs(own, rule))
        self._note.content = _line(
            f"mean F <b>{now:.4f}</b> ({now - before:+.4f} to the run&#39;s rule, {before:.4f})"
            f" &middot; detector alone {base:.4f}"
            f" &middot; oracle of scope {rule.scope} {oracle:.4f}"
            f" &middot; {changed} pairs change sides"
            f"<br>{self._unseen}"
        )
        flat = np.ones(STEPS)
        data = (values, *curve.f_scores().T, curve.mean_f(), base * flat, oracle * flat, now * flat)
        self._plot.data, self._plot.series = data, _series(engine.splits, name)

    def _changed(self) -> frozenset[int]:
        assert self._terms is not None and self._run is not None
        places = self._terms.whatif.changed_pairs(rule_of_run(self._run.settings), self._rule())
        return frozenset(self._terms.pair_ids[int(place)] for place in places)

    def _narrow(self, pairs: frozenset[int] | None) -> None:
        self._desk.filter(only=pairs)


def _series(splits: tuple[str, ...], name: str) -> tuple[uplot.Series, ...]:
    lines = [uplot.Series(label=split, stroke=FAINT, width=1) for split in splits]
    return (
        uplot.Series(label=TITLES[name]),
        *lines,
        uplot.Series(label="mean F", stroke=MEAN, width=3),
        uplot.Series(label="detector alone", stroke=BASE, width=1.5, dash=(6, 4)),
        uplot.Series(label="oracle", stroke=ORACLE, width=1.5, dash=(6, 4)),
        uplot.Series(label="this rule", stroke=HERE, width=1.5),
    )


def _line(text: str) -> str:
    return f'<div style="padding:.5em .75em;font-size:.85em;line-height:1.6">{text}</div>'
