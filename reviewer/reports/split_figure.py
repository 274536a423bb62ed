"""Bars of F by split, methods side by side, without and with DoI: the paper's figure E."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import IO

from matplotlib import rc_context
from matplotlib.figure import Figure

from reviewer.errors import NotFound
from reviewer.evaluation.table_a import AUDITED, Row
from reviewer.evaluation.tables import MEAN
from reviewer.reports.table_a_text import groups_of

COLOURS = ("#14828c", "#7048e8", "#e8590c", "#2f9e44", "#1971c2", "#c2255c", "#5c940d", "#495057")
SHADES = {"": 0.35, AUDITED: 0.7}
"""How strong a method's colour is without DoI and after audit; with DoI it is full."""
BAR_INCHES, LEAST_INCHES, LONG_NAME = 0.11, 8.0, 55


@rc_context({"text.parse_math": False})  # names of runs may hold a dollar
def draw_splits(rows: Sequence[Row], path: Path | IO[bytes]) -> None:
    """Write the figure; the file's ending gives the format.

    Each method is drawn as its runs were made; a repeated one with its spread.

    Raises:
        NotFound: when there is nothing to draw.
    """
    drawn = [row for row in rows if row.own]
    if not drawn:
        raise NotFound("nothing to draw: no run has a prediction of a pair with ground truth")
    methods = list(dict.fromkeys(row.title for row in drawn))
    drawn.sort(key=lambda row: methods.index(row.title))
    groups = groups_of(drawn)[1:]
    width = max(LEAST_INCHES, BAR_INCHES * (len(drawn) + 1.5) * len(groups) + 1)
    figure = Figure(figsize=(width, 3.6 + 0.25 * len(methods)), layout="constrained")
    axes = figure.subplots()
    bar = 0.84 / len(drawn)
    for k, row in enumerate(drawn):
        places = [g + (k - (len(drawn) - 1) / 2) * bar for g in range(len(groups))]
        heights = [row.values.get(group, 0.0) for group in groups]
        errors = [row.spreads.get(group, 0.0) for group in groups] if row.spreads else None
        colour = COLOURS[methods.index(row.title) % len(COLOURS)]
        axes.bar(
            places,
            heights,
            bar * 0.94,
            yerr=errors,
            error_kw={"elinewidth": 0.8},
            color=colour,
            alpha=SHADES.get(row.variant, 1.0),
            label=f"{row.text}, mean {row.values[MEAN]:.3f}",
        )
    axes.set(ylabel="F", ylim=(0, 1))
    axes.set_xticks(range(len(groups)), groups)
    axes.spines[["top", "right"]].set_visible(False)
    columns = 2 if max(len(row.text) for row in drawn) < LONG_NAME else 1
    figure.legend(loc="outside lower center", frameon=False, fontsize=8, ncols=columns)
    figure.savefig(path, dpi=130)
