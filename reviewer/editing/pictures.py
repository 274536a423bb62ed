"""The two images of a pair as people click them: both in the frame of the live image."""

from __future__ import annotations

import numpy as np

from reviewer.dataset.pictures import read_picture
from reviewer.errors import NotFound
from reviewer.models.interfaces import ClickPictures
from reviewer.pipeline.fields import Part, change_of, unpack_flow
from reviewer.pipeline.stored import warped_view
from reviewer.records import Pair, Run
from reviewer.store.database import Store
from reviewer.store.layers import load_alignment, load_detection
from reviewer.store.stages_done import pair_overview
from reviewer.words import Side


def load_pictures(
    store: Store, pair: Pair, run: Run | None, picture: Side, part: Part | None = None
) -> ClickPictures:
    """Return a picture and what a run says beside it: the other one and the confidence of the
    alignment where it aligned the pair, the probability of change where it looked for one. Of a
    large picture a part, rows and columns, is made in a fraction of the time.

    Raises:
        NotFound: when a file is gone, or the reference is asked for without a run that aligns it.
    """
    aligned = run is not None and pair_overview(store, run.id, pair.id).aligned
    whole = read_picture(pair.live)
    live = whole if part is None else np.ascontiguousarray(whole[part])
    if picture == "live" and not aligned:
        return ClickPictures(live)
    chosen = _aligned_run(pair, run)
    warped, _, confidence = warped_view(store, chosen, pair, part)
    first, second = (live, warped) if picture == "live" else (warped, live)
    detection = load_detection(store, chosen.id, pair.id)
    change = None if detection is None else change_of(detection)
    if change is not None and part is not None:
        change = np.ascontiguousarray(change[part])
    return ClickPictures(first, second, confidence, change)


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
