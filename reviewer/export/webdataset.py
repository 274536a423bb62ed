"""`webdataset`: tar shards that stream: `<split>-000000.tar` with t0, t1, mask, json per pair.

Members are `<pair>.t0.png` (or the picture's own format), `<pair>.t1.png`, `<pair>.mask.png` of 0
and 255, `<pair>.ignore.png` where there is one, and `<pair>.json`. They have no times and no
owners: the same export gives the same bytes. A shard holds pairs of one split, so folds can be
read by shard.
"""

from __future__ import annotations

import io
import json
import tarfile
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from reviewer.dataset.pictures import upright_bytes
from reviewer.errors import InvalidInput
from reviewer.export.selection import Labelled, Selection
from reviewer.export.writing import Files, Part, fitting_shard, write_export
from reviewer.masks import decode_rle, encode_png

PAIRS_A_SHARD = 256


def export_webdataset(
    labelled: Sequence[Labelled],
    target: Path,
    selection: Selection,
    pairs_a_shard: int = PAIRS_A_SHARD,
) -> int:
    """Write shards and a manifest; return the number of pairs.

    Raises:
        Conflict: when `target` exists and is not empty.
        NotFound: when an image is gone.
        InvalidInput: for a pair whose name holds a full stop, which ends a key.
    """
    pairs_a_shard = fitting_shard(labelled, pairs_a_shard)
    settings = {**selection.record(), "pairs_a_shard": pairs_a_shard}
    parts = [
        Part(name, items, partial(_shard, name, items), {"shard": name})
        for name, items in _shards(labelled, pairs_a_shard)
    ]
    return write_export(target, "webdataset", settings, parts)


def _shard(name: str, items: Sequence[Labelled]) -> Files:
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w", format=tarfile.USTAR_FORMAT) as tar:
        for item in items:
            for path, data in _members(item).items():
                member = tarfile.TarInfo(path)
                member.size, member.mode = len(data), 0o644
                tar.addfile(member, io.BytesIO(data))
    return {name: buffer.getvalue()}


def _shards(labelled: Sequence[Labelled], size: int) -> Iterator[tuple[str, Sequence[Labelled]]]:
    for split in dict.fromkeys(item.pair.split for item in labelled):
        own = [item for item in labelled if item.pair.split == split]
        for number, start in enumerate(range(0, len(own), size)):
            yield f"{split}-{number:06d}.tar", own[start : start + size]


def _members(item: Labelled) -> dict[str, bytes]:
    pair = item.pair
    if "." in pair.name:
        raise InvalidInput(
            f"pair {pair.title}: its name holds a full stop, where WebDataset ends a key"
        )
    about = {"pair": pair.title, "split": pair.split, "area": item.mask.area, **item.origin}
    files = {
        f"t0{pair.reference.path.suffix.lower()}": upright_bytes(pair.reference),
        f"t1{pair.live.path.suffix.lower()}": upright_bytes(pair.live),
        "mask.png": encode_png(decode_rle(item.mask)),
        "json": json.dumps(about, sort_keys=True).encode(),
    }
    ignore = item.ignore()
    if ignore is not None:
        files["ignore.png"] = encode_png(ignore)
    return {f"{pair.name}.{end}": data for end, data in sorted(files.items())}
