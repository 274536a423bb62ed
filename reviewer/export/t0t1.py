"""`t0t1`: what change detectors train on: `<split>/t0/`, `t1/` and `mask/`, names that match.

`reviewer import --layout t0t1` and the public loaders of this layout read it. Pictures are the
files as they are, or the reference warped to the live view by a run. Masks are 0 and 255, and
pixels that are not to be scored lie in `ignore/`; or, as segmentation loaders want it, masks are 0
and 1 with 255 for those pixels.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from reviewer.export.selection import Labelled, Selection
from reviewer.export.writing import Copy, Files, pair_parts, write_export
from reviewer.masks import decode_rle, encode_png
from reviewer.pipeline.stored import warped_reference
from reviewer.records import Run
from reviewer.store.database import Store
from reviewer.store.results import stage_keys
from reviewer.words import IgnoreMode

CHANGED: dict[IgnoreMode, int] = {"separate": 255, "255": 1, "none": 255}


def export_t0t1(
    store: Store,
    labelled: Sequence[Labelled],
    target: Path,
    selection: Selection,
    *,
    warped_by: Run | None = None,
    ignore: IgnoreMode = "separate",
) -> int:
    """Write pictures and masks; return the number of pairs.

    Args:
        warped_by: warp the references by this run's alignments; None leaves them as they are.
        ignore: where pixels that are not to be scored go.

    Raises:
        Conflict: when `target` exists and is not empty.
        NotFound: when an image is gone, or the run did not align a pair.
    """
    settings = {
        **selection.record(),
        "warped_by": warped_by.name if warped_by else None,
        "ignore": ignore,
    }
    keys = stage_keys(store, warped_by.id, [i.pair.id for i in labelled]) if warped_by else {}
    parts = pair_parts(
        labelled,
        lambda item: _files(store, item, warped_by, ignore),
        lambda item: keys.get(item.pair.id, {}).get("align", ""),
    )
    return write_export(target, "t0t1", settings, parts, changed=CHANGED[ignore])


def _files(store: Store, item: Labelled, warped_by: Run | None, ignore: IgnoreMode) -> Files:
    pair, split = item.pair, item.pair.split
    files: dict[str, bytes | Copy] = {
        f"{split}/t1/{pair.name}{pair.live.path.suffix.lower()}": Copy(pair.live)
    }
    if warped_by is None:
        past = f"{split}/t0/{pair.name}{pair.reference.path.suffix.lower()}"
        files[past] = Copy(pair.reference)
    else:
        warped, _ = warped_reference(store, warped_by, pair)
        ok, data = cv2.imencode(".png", warped[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 1])
        assert ok, "OpenCV refused a plain colour image"
        files[f"{split}/t0/{pair.name}.png"] = data.tobytes()
    mask, beside = (f"{split}/{kind}/{pair.name}.png" for kind in ("mask", "ignore"))
    return {**files, **_masks(item, mask, beside, ignore)}


def _masks(item: Labelled, mask: str, beside: str, mode: IgnoreMode) -> dict[str, bytes]:
    changed, ignored = decode_rle(item.mask), item.ignore()
    if mode == "255":
        levels = changed.astype(np.uint8)
        if ignored is not None:
            levels[ignored] = 255
        ok, data = cv2.imencode(".png", levels)
        assert ok, "OpenCV refused a plain grey image"
        return {mask: data.tobytes()}
    if ignored is None or mode == "none":
        return {mask: encode_png(changed)}
    return {mask: encode_png(changed), beside: encode_png(ignored)}
