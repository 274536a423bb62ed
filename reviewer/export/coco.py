"""COCO instances JSON: one annotation per changed pair or per component; category "change".

Segmentations are RLE. Pairs without change have an image and no annotation, as COCO has it.
`iscrowd` is 0 although the segmentation is RLE: the mask is one region of change, not a crowd;
pycocotools reads both. Pixels that are not to be scored are an annotation more with `iscrowd` 1,
which is how COCO says that.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from reviewer import __version__
from reviewer.errors import Conflict
from reviewer.export.selection import Labelled
from reviewer.masks import Rle, components, decode_rle, encode_rle, read_rle


def coco_document(
    labelled: Sequence[Labelled], *, per_component: bool = False, skipped: Sequence[str] = ()
) -> dict[str, Any]:
    """Return the document; ids of images are the pair ids of the database.

    Args:
        per_component: an annotation for every 8-connected component, in place of one a pair.
        skipped: titles of pairs that were left out as badly aligned, for `info`.
    """
    images: list[dict[str, Any]] = []
    annotations: list[dict[str, Any]] = []

    def annotate(image: int, mask: Rle, *, ill_posed: bool) -> None:
        annotations.append(
            {
                "id": len(annotations) + 1,
                "image_id": image,
                "category_id": 1,
                "segmentation": {"size": [mask.height, mask.width], "counts": mask.counts},
                "area": mask.area,
                "bbox": list(mask.box_xywh),
                "iscrowd": int(ill_posed),
            }
        )

    for item in labelled:
        pair, mask = item.pair, item.mask
        images.append(
            {
                "id": pair.id,
                "file_name": f"{pair.split}/{pair.live.path.name}",
                "height": mask.height,
                "width": mask.width,
                "split": pair.split,
                "pair": pair.name,
                "reference": pair.reference.path.name,
                "sha256": pair.live.sha256,
                **item.origin,
            }
        )
        for part in _components(mask) if per_component else [mask] if mask.area else []:
            annotate(pair.id, part, ill_posed=False)
        if item.ignore_rle is not None:
            ignored = read_rle(mask.height, mask.width, item.ignore_rle)
            annotate(pair.id, ignored, ill_posed=True)
    return {
        "info": {
            "description": "change-detection ground truth",
            "reviewer": __version__,
            **({"skipped": list(skipped)} if skipped else {}),
        },
        "categories": [{"id": 1, "name": "change", "supercategory": "change"}],
        "images": images,
        "annotations": annotations,
    }


def _components(mask: Rle) -> Iterator[Rle]:
    labels, crops = components(decode_rle(mask))
    for number in range(1, len(crops) + 1):
        yield encode_rle(labels == number)


def export_coco(
    labelled: Sequence[Labelled],
    target: Path,
    *,
    per_component: bool = False,
    skipped: Sequence[str] = (),
) -> int:
    """Write the document to the file `target`; return the number of images.

    Raises:
        Conflict: when `target` exists.
    """
    if target.exists():
        raise Conflict(f"{target}: exists already; export into a new file")
    target.parent.mkdir(parents=True, exist_ok=True)
    partial = target.with_name(f".{target.name}.partial")
    document = coco_document(labelled, per_component=per_component, skipped=skipped)
    partial.write_text(json.dumps(document))
    partial.replace(target)
    return len(labelled)
