"""`coco-panoptic`: one PNG of segment ids per live image, and COCO's panoptic JSON.

Every component of change is a thing, all that is unchanged one stuff segment, ill-posed pixels are
void (id 0). Ids are R + 256 G + 65536 B, as COCO has it; nothing is lost.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from reviewer.export.selection import Labelled, Selection
from reviewer.export.writing import Files, pair_parts, write_export
from reviewer.masks import components, crop_to_box, decode_rle

CHANGE, UNCHANGED = 1, 2
CATEGORIES = [
    {"id": CHANGE, "name": "change", "supercategory": "change", "isthing": 1,
     "color": [255, 64, 64]},
    {"id": UNCHANGED, "name": "unchanged", "supercategory": "unchanged", "isthing": 0,
     "color": [90, 96, 105]},
]  # fmt: skip


def export_panoptic(labelled: Sequence[Labelled], target: Path, selection: Selection) -> int:
    """Write `panoptic.json` and `panoptic/<split>/<pair>.png`; return the number of pairs.

    Raises:
        Conflict: when `target` exists and is not empty.
    """

    def finish() -> dict[str, bytes]:
        images, annotations = [], []
        for item in labelled:
            pair = item.pair
            name = f"{pair.split}/{pair.live.path.name}"
            size = {"height": item.mask.height, "width": item.mask.width}
            images.append({"id": pair.id, "file_name": name, **size, "pair": pair.title})
            annotations.append(
                {
                    "image_id": pair.id,
                    "file_name": f"{pair.split}/{pair.name}.png",
                    "segments_info": _segments(_ids(item)),
                }
            )
        document = {"images": images, "annotations": annotations, "categories": CATEGORIES}
        return {"panoptic.json": json.dumps(document).encode()}

    parts = pair_parts(labelled, _files)
    return write_export(target, "coco-panoptic", selection.record(), parts, finish=finish)


def _ids(item: Labelled) -> np.ndarray:
    """Return ids int32 (H, W): 1 = unchanged, 2 and more = one component each, 0 = void."""
    labels, _ = components(decode_rle(item.mask))
    ids = labels + 1
    ignore = item.ignore()
    if ignore is not None:
        ids[ignore] = 0
    return ids


def _files(item: Labelled) -> Files:
    ids = _ids(item)
    blue_first = np.stack([ids >> 16, (ids >> 8) & 255, ids & 255], axis=2).astype(np.uint8)
    ok, data = cv2.imencode(".png", blue_first)
    assert ok, "OpenCV refused a plain colour image"
    return {f"panoptic/{item.pair.split}/{item.pair.name}.png": data.tobytes()}


def _segments(ids: np.ndarray) -> list[dict[str, Any]]:
    segments = []
    for number in np.unique(ids[ids > 0]):
        crop = crop_to_box(np.ascontiguousarray(ids == number))
        assert crop is not None, "an id that is there has pixels"
        x0, y0, x1, y1 = crop.box_xyxy
        segments.append(
            {
                "id": int(number),
                "category_id": UNCHANGED if number == 1 else CHANGE,
                "area": crop.area,
                "bbox": [x0, y0, x1 - x0, y1 - y0],
                "iscrowd": 0,
            }
        )
    return segments
