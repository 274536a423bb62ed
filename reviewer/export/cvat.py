"""`cvat`: "CVAT for images 1.1", every component a `<mask>`; with the live images.

Such a mask is run-lengths by rows inside its box, beginning with the pixels that are off; nothing
is lost. Make a task of the folder `images/` in CVAT, then upload `annotations.xml` to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from reviewer.export.selection import Labelled, Selection
from reviewer.export.writing import Copy, Files, pair_parts, write_export
from reviewer.masks import Crop, Mask, components, decode_rle

LABELS = {"change": "#ff4040", "ill-posed": "#d67eff"}


def export_cvat(labelled: Sequence[Labelled], target: Path, selection: Selection) -> int:
    """Write `annotations.xml` and `images/<split>/<pair>`; return the number of pairs.

    Raises:
        Conflict: when `target` exists and is not empty.
        NotFound: when an image is gone.
    """
    parts = pair_parts(labelled, _files)

    def finish() -> dict[str, bytes]:
        root = document(labelled)
        ElementTree.indent(root)
        data = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
        return {"annotations.xml": data}

    return write_export(target, "cvat", selection.record(), parts, finish=finish)


def document(labelled: Sequence[Labelled]) -> ElementTree.Element:
    """Return the root element of `annotations.xml`."""
    root = ElementTree.Element("annotations")
    ElementTree.SubElement(root, "version").text = "1.1"
    task = ElementTree.SubElement(ElementTree.SubElement(root, "meta"), "task")
    labels = ElementTree.SubElement(task, "labels")
    for name, colour in LABELS.items():
        label = ElementTree.SubElement(labels, "label")
        for tag, text in (("name", name), ("color", colour), ("type", "mask")):
            ElementTree.SubElement(label, tag).text = text
        ElementTree.SubElement(label, "attributes")
    for number, item in enumerate(labelled):
        image = ElementTree.SubElement(
            root,
            "image",
            id=str(number),
            name=_name(item),
            width=str(item.mask.width),
            height=str(item.mask.height),
        )
        _add(image, decode_rle(item.mask), "change")
        ignore = item.ignore()
        if ignore is not None:
            _add(image, ignore, "ill-posed")
    return root


def _name(item: Labelled) -> str:
    return f"{item.pair.split}/{item.pair.name}{item.pair.live.path.suffix.lower()}"


def _files(item: Labelled) -> Files:
    return {f"images/{_name(item)}": Copy(item.pair.live)}


def _add(image: ElementTree.Element, mask: Mask, label: str) -> None:
    for crop in components(mask)[1]:
        height, width = crop.pixels.shape
        ElementTree.SubElement(
            image,
            "mask",
            label=label,
            source="manual",
            occluded="0",
            rle=", ".join(str(run) for run in runs_by_row(crop)),
            left=str(crop.x),
            top=str(crop.y),
            width=str(width),
            height=str(height),
            z_order="0",
        )


def runs_by_row(crop: Crop) -> list[int]:
    """Return run-lengths by rows, starting with the unset pixels (0 when there are none)."""
    flat = crop.pixels.ravel()
    changes = np.flatnonzero(np.diff(flat)) + 1
    runs = np.diff(np.concatenate(([0], changes, [len(flat)])))
    return ([0] if flat[0] else []) + [int(run) for run in runs]
