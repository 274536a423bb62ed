"""Rows of reference, live, ground truth and each method's mask: the paper's figure F.

Changes are small, so the masks are shown enlarged: a frame in the live picture says which part.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import IO

import cv2
import numpy as np
import numpy.typing as npt
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from reviewer.dataset.pictures import read_picture
from reviewer.errors import NotFound
from reviewer.evaluation.tables import METHOD_TITLE
from reviewer.masks import Mask, crop_to_box, decode_rle, union
from reviewer.metrics import Counts, f_score
from reviewer.records import Pair, Run
from reviewer.store.database import Store
from reviewer.store.layers import load_alignment
from reviewer.store.pairs import list_pairs
from reviewer.store.regions import load_prediction
from reviewer.store.scores import pair_counts, pair_scores
from reviewer.store.truth import truth_of_pair
from reviewer.words import Method, Standing

Image = npt.NDArray[np.uint8]

RIGHT, WRONG, MISSED, IGNORED = (38, 190, 180), (240, 96, 60), (86, 150, 255), (120, 100, 140)
"""Colours of changed and found, found but unchanged, changed but not found, not scored."""
CELL = 2.0
LEAST_SHARE, MARGIN = 0.22, 0.2
"""Of the picture that is shown enlarged, and around the changes."""


def telling_pairs(
    store: Store, run: Run, count: int, standings: Sequence[Standing] = ()
) -> list[str]:
    """Return titles of pairs to look at: half where DoI gains most F, half where it loses most.

    Where it loses nowhere, those with the lowest F take their place. Pairs without change in which
    nothing was found tell nothing.
    """
    scores = _scores(store, run, standings)
    base, doi = scores["base"], scores["doi"]
    both = sorted(base.keys() | doi.keys())
    base, doi = ({title: found.get(title, 0.0) for title in both} for found in (base, doi))
    by_gain = sorted(both, key=lambda title: (base[title] - doi[title], title))
    by_loss = sorted(both, key=lambda title: (min(0.0, doi[title] - base[title]), doi[title]))
    gains = [title for title in by_gain if doi[title] > base[title]][: (count + 1) // 2]
    losses = [title for title in by_loss if title not in gains][: count - len(gains)]
    return gains + losses


def _scores(
    store: Store, run: Run, standings: Sequence[Standing] = ()
) -> dict[Method, dict[str, float]]:
    """Return F of the pairs that have one of their own, by method and title."""
    title = {pair.id: pair.title for pair in list_pairs(store)}
    found: dict[Method, dict[str, float]] = {method: {} for method in METHOD_TITLE}
    for score in pair_scores(store, run.name, standings):
        if not score.counts.rightly_empty:
            found[score.method][title[score.pair_id]] = f_score(score.counts)
    return found


@rc_context({"text.parse_math": False})  # names of runs may hold a dollar
def draw_rows(
    store: Store, runs: Sequence[Run], pairs: Sequence[Pair], path: Path | IO[bytes]
) -> None:
    """Write one row per pair; the file's ending gives the format (PNG for an open file).

    Raises:
        NotFound: when there is no pair, or one has no ground truth.
    """
    if not pairs or not runs:
        raise NotFound("figure F: no pair has both ground truth and a prediction")
    methods: list[Method] = ["base", "doi"]
    columns = ["reference", "live", "ground truth"]
    columns += [f"{run.name}\n{METHOD_TITLE[method]}" for run in runs for method in methods]
    height, width = pairs[0].live.height, pairs[0].live.width
    size = (CELL * len(columns), CELL * height / width * len(pairs) + 0.75)
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(len(pairs), len(columns), squeeze=False)
    for row, pair in zip(grid, pairs, strict=True):
        cells = cells_of(store, runs, methods, pair)
        for axes, (cell, note) in zip(row, cells, strict=True):
            axes.set_xticks([])
            axes.set_yticks([])
            axes.spines[:].set_visible(False)
            if cell is not None:
                axes.imshow(cell, interpolation="nearest" if note else "antialiased")
            if note:
                axes.text(
                    0.98, 0.03, note, transform=axes.transAxes, color="white", fontsize=7,
                    ha="right", bbox={"facecolor": "#000000a0", "edgecolor": "none", "pad": 1.5},
                )  # fmt: skip
        row[0].set_ylabel(pair.title, fontsize=8)
    for axes, title in zip(grid[0], columns, strict=True):
        axes.set_title(_short(title), fontsize=8)
    named = {"right": RIGHT, "wrong": WRONG, "missed": MISSED, "not scored": IGNORED}
    handles = [
        Patch(color=(red / 255, green / 255, blue / 255), label=name)
        for name, (red, green, blue) in named.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False, fontsize=8)
    figure.savefig(path, dpi=130)


def _short(title: str) -> str:
    name, line, method = title.partition("\n")
    return f"{name if len(name) < 24 else name[:22] + '…'}{line}{method}"


def cells_of(
    store: Store, runs: Sequence[Run], methods: Sequence[Method], pair: Pair
) -> list[tuple[Image | None, str]]:
    """Return the pictures of a row with their notes: reference, live, ground truth, then a mask per
    run and method (None where there is none).

    Raises:
        NotFound: when the pair has no ground truth.
    """
    revision = truth_of_pair(store, pair.id)
    if revision is None:
        raise NotFound(f"figure F: pair {pair.title} has no ground truth")
    live, truth, ignore = read_picture(pair.live), decode_rle(revision.mask), revision.ignore()
    found = {
        (run.name, method): decode_rle(rle)
        for run in runs
        for method in methods
        if (rle := load_prediction(store, run.id, pair.id, method)) is not None
    }
    rows, columns = telling_window(truth, list(found.values()))
    framed = live.copy()
    corners = (columns.start, rows.start), (columns.stop - 1, rows.stop - 1)
    cv2.rectangle(framed, *corners, (255, 214, 64), 4)
    cells: list[tuple[Image | None, str]] = [
        (read_picture(pair.reference), ""),
        (framed, ""),
        (overlaid(live, truth, truth, ignore)[rows, columns], ""),
    ]
    for run in runs:
        counts = pair_counts(store, run.id, pair.id)
        left_out = _left_out(store, run, pair, ignore)
        for method in methods:
            mask = found.get((run.name, method))
            if mask is None:
                cells.append((None, ""))
                continue
            picture = overlaid(live, mask, truth, left_out)[rows, columns]
            cells.append((picture, _note(counts.get(method))))
    return cells


def _left_out(store: Store, run: Run, pair: Pair, ignore: Mask | None) -> Mask | None:
    """Return the pixels that a run is not scored on."""
    alignment = load_alignment(store, run.id, pair.id)
    if alignment is None:
        return ignore
    unseen = ~decode_rle(alignment.valid)
    return unseen if ignore is None else unseen | ignore


def _note(counts: Counts | None) -> str:
    if counts is None:
        return "not counted"
    if not counts.rightly_empty:
        return f"F {f_score(counts):.2f}"
    return "unseen" if counts.unseen_objects else "correctly empty"


def telling_window(truth: Mask, found: Sequence[Mask]) -> tuple[slice, slice]:
    """Return rows and columns around the changes (around what was found, where nothing changed), of
    the picture's own proportions; the whole picture where there is nothing to look at."""
    height, width = truth.shape
    around = crop_to_box(truth) or crop_to_box(union(found, height, width))
    if around is None:
        return slice(0, height), slice(0, width)
    x0, y0, x1, y1 = around.box_xyxy
    share = max((x1 - x0) / width, (y1 - y0) / height) * (1 + 2 * MARGIN)
    share = min(max(share, LEAST_SHARE), 1.0)
    across, down = round(share * width), round(share * height)
    left = min(max((x0 + x1 - across) // 2, 0), width - across)
    top = min(max((y0 + y1 - down) // 2, 0), height - down)
    return slice(top, top + down), slice(left, left + across)


def overlaid(live: Image, found: Mask, truth: Mask, ignore: Mask | None) -> Image:
    """Return the live image in grey, with right, wrong, missed and unscored pixels in colour."""
    grey = live.mean(axis=2, keepdims=True)
    picture = np.repeat(grey * 0.5 + 20, 3, axis=2)
    layers = [(found & truth, RIGHT), (found & ~truth, WRONG), (truth & ~found, MISSED)]
    if ignore is not None:
        layers.append((ignore, IGNORED))
    for mask, colour in layers:
        picture[mask] = 0.2 * picture[mask] + 0.8 * np.array(colour)
    return picture.astype(np.uint8)
