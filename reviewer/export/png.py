"""PNG tree: `<split>/<pair>.png`, 0 = unchanged, 255 = changed, and a manifest with hashes."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from reviewer.atomic import whole_folder
from reviewer.export.manifest import pair_entry, write_manifest
from reviewer.export.selection import Labelled, Selection
from reviewer.masks import decode_rle, encode_png


def export_png(labelled: Sequence[Labelled], target: Path, selection: Selection) -> int:
    """Write the masks, and ignore masks beside them as `<pair>.ignore.png`; return their number.

    Raises:
        Conflict: when `target` exists and is not empty.
    """
    with whole_folder(target) as folder:
        for split in {item.pair.split for item in labelled}:
            (folder / split).mkdir()

        def write(item: Labelled) -> dict[str, Any]:
            name = f"{item.pair.split}/{item.pair.name}"
            files = {f"{name}.png": encode_png(decode_rle(item.mask))}
            ignore = item.ignore()
            if ignore is not None:
                files[f"{name}.ignore.png"] = encode_png(ignore)
            for path, data in files.items():
                (folder / path).write_bytes(data)
            return pair_entry(item, files)

        with ThreadPoolExecutor() as pool:
            entries = list(pool.map(write, labelled))
        write_manifest(folder, "png", selection.record(), entries)
    return len(labelled)
