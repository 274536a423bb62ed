"""PNG tree: `<split>/<pair>.png`, 0 = unchanged, 255 = changed, and a manifest with hashes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from reviewer import __version__
from reviewer.atomic import whole_folder
from reviewer.export.selection import Labelled
from reviewer.masks import Rle, decode_rle, encode_png


def export_png(labelled: Sequence[Labelled], target: Path) -> int:
    """Write the masks, and ignore masks beside them as `<pair>.ignore.png`; return their number.

    Raises:
        Conflict: when `target` exists and is not empty.
    """
    with whole_folder(target) as folder:
        for split in {item.pair.split for item in labelled}:
            (folder / split).mkdir()

        def write(item: Labelled) -> dict[str, Any]:
            return _write_pair(folder, item)

        with ThreadPoolExecutor() as pool:
            entries = list(pool.map(write, labelled))
        manifest = {
            "format": "png",
            "changed": 255,
            "unchanged": 0,
            "reviewer": __version__,
            "pairs": entries,
        }
        (folder / "manifest.json").write_text(json.dumps(manifest, indent=1))
    return len(labelled)


def _write_pair(folder: Path, item: Labelled) -> dict[str, Any]:
    pair, revision = item.pair, item.revision
    path = Path(pair.split) / f"{pair.name}.png"
    data = encode_png(decode_rle(revision.mask))
    (folder / path).write_bytes(data)
    entry: dict[str, Any] = {
        "pair": pair.title,
        "mask": path.as_posix(),
        "sha256": hashlib.sha256(data).hexdigest(),
        "area": revision.mask.area,
        "revision": revision.number,
        "annotator": revision.annotator,
        "live": pair.live.name,
        "live_sha256": pair.live.sha256,
        "reference": pair.reference.name,
        "reference_sha256": pair.reference.sha256,
    }
    if revision.ignore_rle:
        mask = revision.mask
        ignore = Rle(mask.height, mask.width, revision.ignore_rle, 0, (0, 0, 0, 0))
        ignore_path = path.with_suffix(".ignore.png")
        (folder / ignore_path).write_bytes(encode_png(decode_rle(ignore)))
        entry["ignore"] = ignore_path.as_posix()
    return entry
