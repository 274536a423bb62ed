"""The figure of an audit: risk-coverage of every predictor beside the reliability of DoI."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import IO

from matplotlib.figure import Figure

from reviewer.evaluation.predictors import Predictor

COLOURS = ("#14828c", "#7048e8", "#e8590c", "#868e96")
SOFT = "#868e96"


def draw_predictors(predictors: Sequence[Predictor], path: Path | IO[bytes]) -> None:
    """Write both plots into one file; its ending gives the format.

    The reliability is that of the first and of the last DoI line: all regions, whose DoI of 1 is
    mostly "no object", and those in which there is an object and f_b = 1.
    """
    figure = Figure(figsize=(11, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    for found, colour in zip(predictors, COLOURS, strict=True):
        style = "--" if colour == SOFT else "-"
        if found.curve:
            coverage, risk = zip(*found.curve, strict=True)
            label = f"{found.title}: AUROC {found.auroc.value:.3f}, AURC {found.aurc.value:.3f}"
            left.plot(coverage, risk, style, color=colour, linewidth=2, label=label)
    left.set(xlabel="coverage, most trusted (lowest score) first", ylabel="risk, mean 1 - IoU")
    left.set(xlim=(0, 1), ylim=(0, 1), title="Risk and coverage")
    right.plot([0, 1], [0, 1], color=SOFT, linestyle="--", linewidth=1)
    for place in (0, 2):
        colour, aside = COLOURS[place], (5, 5) if place else (5, -11)
        for score, share, count in predictors[place].bins:
            size = 20 + 2.5 * count
            right.scatter(score, share, s=size, facecolors="none", edgecolors=colour, linewidth=2)
            right.annotate(
                str(count), (score, share), aside, textcoords="offset points", fontsize=8,
                color=colour,
            )  # fmt: skip
    right.set(xlabel="DoI", ylabel="share of regions with IoU < 0.5", title="Reliability")
    right.set(xlim=(-0.03, 1.06), ylim=(-0.03, 1.06))
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside lower center", ncols=2, frameon=False, fontsize=8)
    figure.savefig(path, dpi=130)
