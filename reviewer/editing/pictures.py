"""The two images of a pair as people click them: both in the frame of the live image."""

from __future__ import annotations

import numpy as np

from reviewer.dataset.pictures import read_picture
from reviewer.errors import NotFound
from reviewer.models.interfaces import Field, Image
from reviewer.pipeline.fields import Part, unpack_flow
from reviewer.pipeline.stored import warped_view
from reviewer.records import Pair, Run
from reviewer.store.database import Store
from reviewer.store.layers import load_alignment
from reviewer.store.stages_done import pair_overview
from reviewer.words import Side


def load_pictures(
    store: Store, pair: Pair, run: Run | None, picture: Side, part: Part | None = None
) -> tuple[Image, Image | None, Field | None]:
    """Return a picture, uint8 RGB, the other one, and the confidence of the alignment; None for
    the last two where no run aligns the reference, and for the last where its aligner has none. Of
    a large picture a part, rows and columns, is made in a fraction of the time.

    Raises:
        NotFound: when a file is gone, or the reference is asked for without a run that aligns it.
    """
    aligned = run is not None and pair_overview(store, run.id, pair.id).aligned
    whole = read_picture(pair.live)
    live = whole if part is None else np.ascontiguousarray(whole[part])
    if picture == "live" and not aligned:
        return live, None, None
    warped, _, confidence = warped_view(store, _aligned_run(pair, run), pair, part)
    first, second = (live, warped) if picture == "live" else (warped, live)
    return first, second, confidence


def live_point(
    store: Store, pair: Pair, run: Run | None, x: float, y: float
) -> tuple[float, float]:
    """Return where a point of the reference image lies in the live image, both in pixels.

    Raises:
        NotFound: when no run aligns the pair.
    """
    alignment = load_alignment(store, _aligned_run(pair, run).id, pair.id)
    if alignment is None:
        raise NotFound(f"pair {pair.title}: not aligned yet; run `reviewer run align`")
    height, width = pair.live.height, pair.live.width
    flow = unpack_flow(alignment.flow, height, width, alignment.flow_stride)
    across = flow[..., 0] + np.arange(width, dtype=np.float32)[None, :] + 0.5 - x
    down = flow[..., 1] + np.arange(height, dtype=np.float32)[:, None] + 0.5 - y
    row, column = divmod(int(np.argmin(across**2 + down**2)), width)
    return column + 0.5, row + 0.5


def _aligned_run(pair: Pair, run: Run | None) -> Run:
    if run is None:
        raise NotFound(f"pair {pair.title}: no run aligns the reference; run `reviewer run align`")
    return run
