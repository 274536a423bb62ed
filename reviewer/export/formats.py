"""All formats by name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from reviewer.errors import InvalidInput
from reviewer.export.coco import export_coco
from reviewer.export.cvat import export_cvat
from reviewer.export.folds import export_folds
from reviewer.export.huggingface import export_huggingface
from reviewer.export.labelme import export_labelme
from reviewer.export.panoptic import export_panoptic
from reviewer.export.png import export_png
from reviewer.export.selection import Labelled, Selection
from reviewer.export.t0t1 import export_t0t1
from reviewer.export.webdataset import export_webdataset
from reviewer.export.yolo import export_yolo
from reviewer.records import Run
from reviewer.store.database import Store
from reviewer.words import EXPORT_FORMATS, FoldKind, IgnoreMode


@dataclass(frozen=True, slots=True)
class Options:
    """Options of single formats, in addition to the selection; see `coco`, `t0t1` and `folds`."""

    warped_by: Run | None = None
    ignore: IgnoreMode = "separate"
    by: FoldKind = "same-split"
    parts: int = 5
    per_component: bool = False


PLAIN: dict[str, Callable[[Sequence[Labelled], Path, Selection], int]] = {
    "png": export_png,
    "coco-panoptic": export_panoptic,
    "labelme": export_labelme,
    "cvat": export_cvat,
    "yolo-seg": export_yolo,
    "huggingface": export_huggingface,
    "webdataset": export_webdataset,
}


def export_as(
    store: Store,
    form: str,
    labelled: Sequence[Labelled],
    target: Path,
    selection: Selection,
    options: Options,
) -> int:
    """Write `target` in a format; return the number of pairs, or of folds.

    Raises:
        Conflict: when `target` exists and is not empty.
        NotFound: when an image is gone.
        InvalidInput: when the format does not exist, or cannot hold something.
    """
    if form == "t0t1":
        return export_t0t1(
            store, labelled, target, selection, warped_by=options.warped_by, ignore=options.ignore
        )
    if form == "coco":
        return export_coco(
            labelled,
            target,
            per_component=options.per_component,
            skipped=selection.skipped,
        )
    if form == "folds":
        return export_folds(store, labelled, target, selection, options.by, options.parts)
    if form not in PLAIN:
        known = ", ".join(EXPORT_FORMATS)
        raise InvalidInput(f"export {form!r}: there are {known}")
    return PLAIN[form](labelled, target, selection)
