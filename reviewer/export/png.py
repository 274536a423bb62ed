"""PNG tree: `<split>/<pair>.png`, 0 = unchanged, 255 = changed, and a manifest with hashes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from reviewer.export.selection import Labelled, Selection
from reviewer.export.writing import Files, pair_parts, write_export
from reviewer.masks import decode_rle, encode_png


def export_png(labelled: Sequence[Labelled], target: Path, selection: Selection) -> int:
    """Write the masks, and ignore masks beside them as `<pair>.ignore.png`; return their number.

    Raises:
        Conflict: when `target` exists and is not empty.
    """
    return write_export(target, "png", selection.record(), pair_parts(labelled, _files))


def _files(item: Labelled) -> Files:
    name = f"{item.pair.split}/{item.pair.name}"
    files = {f"{name}.png": encode_png(decode_rle(item.mask))}
    ignore = item.ignore()
    if ignore is not None:
        files[f"{name}.ignore.png"] = encode_png(ignore)
    return files
