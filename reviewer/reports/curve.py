"""Draw the curve of a training: loss below, scores on the synthetic validation above."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from reviewer.atomic import whole_file
from reviewer.training.log import read_log


def draw_curve(folder: Path) -> None:
    """Write `curve.png` of the training in a folder, from its log and its record."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows = read_log(folder / "log.csv")
    known = json.loads((folder / "training.json").read_text(encoding="utf-8"))["training"]
    iterations = np.array([int(row["iteration"]) for row in rows])
    loss = np.array([float(row["loss"]) for row in rows])
    figure = Figure(figsize=(8, 5.2), layout="constrained")
    FigureCanvasAgg(figure)
    upper, lower = figure.subplots(2, 1, sharex=True)
    scored = [row for row in rows if row["f_score"]]
    at = [int(row["iteration"]) for row in scored]
    for name, label, colour in (
        ("precision", "precision", "#7aa6c2"),
        ("recall", "recall", "#c29a7a"),
        ("f_score", "F-score", "#b0305c"),
    ):
        values = [float(row[name]) for row in scored]
        width = 2.2 if name == "f_score" else 1.3
        upper.plot(at, values, marker="o", markersize=3, label=label, color=colour, lw=width)
    upper.set(ylim=(0, 1), ylabel="synthetic validation")
    upper.legend(loc="lower right", frameon=False)
    lower.semilogy(iterations, loss, color="#c9ccd6", lw=0.7, label="every iteration")
    smooth = _smoothed(loss)
    lower.semilogy(iterations, smooth, color="#3b4a6b", lw=1.8, label="running mean")
    lower.set(xlabel="iteration", ylabel="loss")
    lower.legend(loc="upper right", frameon=False)
    for axes in (upper, lower):
        axes.grid(alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
    figure.suptitle(f"{known['net']}, width {known['width']:g}")
    with whole_file(folder / "curve.png") as file:
        figure.savefig(file, format="png", dpi=110)


def _smoothed(values: np.ndarray) -> np.ndarray:
    window = max(1, len(values) // 40)
    summed = np.cumsum(np.concatenate([[0.0], values]))
    end = np.arange(1, len(values) + 1)
    start = np.maximum(0, end - window)
    return np.asarray((summed[end] - summed[start]) / (end - start))
