"""Two views of a rendered place, kept in a file, and pieces of them as views to learn from.

Unlike views before a photograph (`synthesis.views`) they have true parallax and occlusion: the flow
comes from the scene's geometry. Light, noise and compression are drawn anew for every piece.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
import numpy.typing as npt

from reviewer.atomic import whole_file
from reviewer.errors import InvalidInput
from reviewer.synthesis.paste import Rng
from reviewer.synthesis.views import LEAST_PX, Changed, Image, Views, ViewSettings, taken

Labels = npt.NDArray[np.uint8]
TRIES = 8
"""How often a piece with a change is looked for."""


@dataclass(frozen=True, slots=True)
class RenderedViews:
    """Two noise-free views of a place.

    Attributes:
        reference, live: uint8 RGB (H, W, 3).
        flow: float16 (H, W, 2), as in `Views`; of what stands behind a thing that went.
        seen: bool (H, W), as in `Views`.
        came: uint8 (H, W), number of the thing of the live view that came, 0 = none.
        went: uint8 (H, W), the same of the reference. left: where the live view shows its place.
        standing: uint8 (H, W), number of what stands in both, live view; 0 = the shell.
    """

    reference: Image
    live: Image
    flow: npt.NDArray[np.float16]
    seen: npt.NDArray[np.bool_]
    came: Labels
    went: Labels
    left: Labels
    standing: Labels


def save_rendered(path: Path, views: RenderedViews) -> None:
    """Write a file, whole or not at all."""
    with whole_file(path) as file:
        np.savez_compressed(file, **{f.name: getattr(views, f.name) for f in fields(views)})


def load_rendered(path: Path) -> RenderedViews:
    """Read a file.

    Raises:
        InvalidInput: when it holds something else.
    """
    try:
        with np.load(path, allow_pickle=False) as content:
            return RenderedViews(**{f.name: content[f.name] for f in fields(RenderedViews)})
    except (KeyError, ValueError, OSError, EOFError, BadZipFile) as error:
        raise InvalidInput(f"{path}: holds no rendered views, {error}") from error


def piece_of(rendered: RenderedViews, settings: ViewSettings, rng: Rng) -> Views:
    """Cut a square out of both views and photograph it; mostly one in which something changed.

    Raises:
        InvalidInput: when the views are smaller than the square.
    """
    side = settings.side
    height, width = rendered.live.shape[:2]
    if min(height, width) < side:
        raise InvalidInput(
            f"rendered views: {width}x{height} px are smaller than a piece of {side} px"
        )
    for _ in range(TRIES):
        top, left = (int(rng.integers(0, n - side + 1)) for n in (height, width))
        window = (slice(top, top + side), slice(left, left + side))
        if rendered.came[window].any() or rendered.left[window].any() or rng.random() < 0.2:
            break
    reference, live, flow, seen, came, went, gone, standing = (
        getattr(rendered, f.name)[window] for f in fields(rendered)
    )
    if rng.random() < 0.5:
        reference, live, seen, came, went, gone, standing = (
            np.ascontiguousarray(v[:, ::-1])
            for v in (reference, live, seen, came, went, gone, standing)
        )
        flow = flow[:, ::-1] * np.array([-1, 1], np.float16)
    flow = flow.astype(np.float32)
    rows, columns = np.mgrid[:side, :side]
    x, y = columns + flow[..., 0], rows + flow[..., 1]
    seen = seen & (x >= 0) & (x <= side - 1) & (y >= 0) & (y <= side - 1)
    changed = [Changed(m := came == n, True, m) for n in _numbers(came)]
    changed += [Changed(gone == n, False, went == n) for n in _numbers(gone)]
    blurred = bool(rng.random() < 0.5)
    return Views(
        taken(reference.astype(np.float32), settings, rng, blurred=blurred),
        taken(live.astype(np.float32), settings, rng, blurred=not blurred),
        flow,
        seen,
        tuple(c for c in changed if np.count_nonzero(c.mask) >= LEAST_PX),
        tuple(
            m for n in _numbers(standing)
            if LEAST_PX <= np.count_nonzero(m := standing == n) < side * side // 4
        ),
    )  # fmt: skip


def _numbers(labels: Labels) -> list[int]:
    return [int(n) for n in np.unique(labels) if n]
