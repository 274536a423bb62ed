"""`labelme`: a JSON file beside each live image, its components as shapes of type "mask".

labelme (5.1 and later) keeps such a shape as a PNG of its box, so that nothing is lost. Components
are `change`, ill-posed ones `ill-posed`; `flags` and the description are left to people. The
reference image lies beside, for looking at.
"""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from PIL import Image as PillowImage

from reviewer.export.selection import Labelled, Selection
from reviewer.export.writing import Copy, Files, pair_parts, write_export
from reviewer.masks import Crop, Mask, components, decode_rle

VERSION = "5.5.0"
"""Of the file format; labelme writes its own version there, and reads any."""


def export_labelme(labelled: Sequence[Labelled], target: Path, selection: Selection) -> int:
    """Write `<split>/<pair>.json` and the live images; return the number of pairs.

    Raises:
        Conflict: when `target` exists and is not empty.
        NotFound: when an image is gone.
    """
    return write_export(target, "labelme", selection.record(), pair_parts(labelled, _files))


def _files(item: Labelled) -> Files:
    pair, ignore = item.pair, item.ignore()
    shapes = _shapes(decode_rle(item.mask), "change")
    if ignore is not None:
        shapes += _shapes(ignore, "ill-posed")
    suffix = pair.live.path.suffix.lower()
    document = {
        "version": VERSION,
        "flags": {},
        "shapes": shapes,
        "imagePath": f"{pair.name}{suffix}",
        "imageData": None,
        "imageHeight": item.mask.height,
        "imageWidth": item.mask.width,
        "pair": pair.title,
        "reference": f"reference/{pair.name}{pair.reference.path.suffix.lower()}",
        **item.origin,
    }
    return {
        f"{pair.split}/{pair.name}.json": json.dumps(document, indent=1).encode(),
        f"{pair.split}/{pair.name}{suffix}": Copy(pair.live),
        f"{pair.split}/{document['reference']}": Copy(pair.reference),
    }


def _shapes(mask: Mask, label: str) -> list[dict[str, Any]]:
    return [_shape(crop, label) for crop in components(mask)[1]]


def _shape(crop: Crop, label: str) -> dict[str, Any]:
    buffer = io.BytesIO()
    PillowImage.fromarray(crop.pixels).save(buffer, "PNG")
    x0, y0, x1, y1 = crop.box_xyxy
    return {
        "label": label,
        # Both corners belong to the box.
        "points": [[float(x0), float(y0)], [float(x1 - 1), float(y1 - 1)]],
        "group_id": None,
        "description": "",
        "shape_type": "mask",
        "flags": {},
        "mask": base64.b64encode(buffer.getvalue()).decode("ascii"),
    }
