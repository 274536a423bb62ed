"""Bars of F by split, without and with DoI: the paper's figure E."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import IO

from matplotlib import rc_context
from matplotlib.figure import Figure

from reviewer.errors import NotFound
from reviewer.evaluation.tables import MEAN, METHOD_TITLE, Line

COLOURS = {"base": "#adb5bd", "doi": "#14828c", "audited": "#f59f00"}


@rc_context({"text.parse_math": False})  # names of runs may hold a dollar
def draw_splits(lines: Sequence[Line], path: Path | IO[bytes]) -> None:
    """Write a panel a run; the name's ending says which format.

    Raises:
        NotFound: when there is nothing to draw.
    """
    runs = list(dict.fromkeys(line.run for line in lines))
    if not runs:
        raise NotFound("nothing to draw: no run has a prediction of a pair with ground truth")
    groups = sorted({line.split for line in lines} - {MEAN})
    width = max(6.0, 0.62 * len(groups) + 2)
    figure = Figure(figsize=(width, 2.3 * len(runs) + 0.5), layout="constrained")
    for axes, run in zip(figure.subplots(len(runs), 1, squeeze=False)[:, 0], runs, strict=True):
        own = [line for line in lines if line.run == run]
        methods = [method for method in METHOD_TITLE if any(line.method == method for line in own)]
        bar = 0.8 / len(methods)
        for k, method in enumerate(methods):
            score = {line.split: line.f_score for line in own if line.method == method}
            places = [g + (k - (len(methods) - 1) / 2) * bar for g in range(len(groups))]
            heights = [score.get(group, 0.0) for group in groups]
            title = f"{METHOD_TITLE[method]}, mean {score[MEAN]:.3f}"
            axes.bar(places, heights, bar * 0.94, color=COLOURS[method], label=title)
        axes.set(ylabel="F", ylim=(0, 1), title=run)
        axes.set_xticks(range(len(groups)), groups)
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(frameon=False, ncols=len(methods), loc="upper right", fontsize=9)
        axes.set_ylim(0, 1.16)
        axes.set_yticks([0, 0.25, 0.5, 0.75, 1])
    figure.savefig(path, dpi=130)
