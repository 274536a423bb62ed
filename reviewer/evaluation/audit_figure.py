"""The figure of an audit: risk-coverage beside reliability."""

from __future__ import annotations

from pathlib import Path
from typing import IO

from matplotlib.figure import Figure

from reviewer.evaluation.audit import Predictor

ACCENT, SOFT = "#14828c", "#868e96"


def draw_predictor(found: Predictor, path: Path | IO[bytes]) -> None:
    """Write both plots into one file; its name's ending says which format."""
    figure = Figure(figsize=(9, 3.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    if found.curve:
        coverage, risk = zip(*found.curve, strict=True)
        left.plot(coverage, risk, color=ACCENT, linewidth=2, label=f"AURC {found.aurc.value:.3f}")
    left.axhline(found.aurc_random, color=SOFT, linestyle="--", linewidth=1, label="random order")
    left.set(xlabel="coverage, most trusted (lowest DoI) first", ylabel="risk, mean 1 - IoU")
    left.set(xlim=(0, 1), ylim=(0, 1), title="Risk and coverage")
    left.legend(frameon=False)
    right.plot([0, 1], [0, 1], color=SOFT, linestyle="--", linewidth=1)
    for score, share, count in found.bins:
        right.scatter(score, share, s=20 + 2.5 * count, color=ACCENT, alpha=0.75, linewidth=0)
        right.annotate(str(count), (score, share), (5, 5), textcoords="offset points", fontsize=8)
    right.set(xlabel="DoI", ylabel="share of regions with IoU < 0.5", title="Reliability")
    right.set(xlim=(-0.03, 1.06), ylim=(-0.03, 1.06))
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=130)
