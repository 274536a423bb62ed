"""`huggingface`: Parquet files with the pictures in them, which `datasets.load_dataset` reads.

One row per pair: names, reference, live, mask (0 and 255), ignore (or null), area, source of
the mask. One Hugging Face split, "train"; lists of pairs to train and test on come from `folds`.
Needs the extra `reviewer[huggingface]`.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from reviewer.dataset.pictures import upright_bytes
from reviewer.errors import NotFound
from reviewer.export.selection import Labelled, Selection
from reviewer.export.writing import Files, Part, fitting_shard, write_export
from reviewer.masks import decode_rle, encode_png

if TYPE_CHECKING:
    import datasets

PAIRS_A_FILE = 256


def export_huggingface(
    labelled: Sequence[Labelled],
    target: Path,
    selection: Selection,
    pairs_a_file: int = PAIRS_A_FILE,
) -> int:
    """Write `data/train-*.parquet` and a card; return the number of pairs.

    Raises:
        Conflict: when `target` exists and is not empty.
        NotFound: when an image is gone, or the extra is not installed.
    """
    try:
        import datasets
    except ImportError as error:
        raise NotFound(
            "export huggingface: needs datasets, install reviewer[huggingface]"
        ) from error
    pairs_a_file = fitting_shard(labelled, pairs_a_file)
    shards = [labelled[k : k + pairs_a_file] for k in range(0, len(labelled), pairs_a_file)]
    features = _features(datasets)
    parts = []

    def card() -> dict[str, bytes]:
        return {"README.md": _card(len(labelled)).encode()}

    for number, items in enumerate(shards):
        name = f"data/train-{number:05d}-of-{len(shards):05d}.parquet"
        parts.append(Part(name, items, partial(_shard, name, items, features), {"file": name}))

    settings = {**selection.record(), "pairs_a_file": pairs_a_file}
    return write_export(target, "huggingface", settings, parts, finish=card)


def _features(datasets: Any) -> datasets.Features:
    text, number, picture = datasets.Value("string"), datasets.Value("int64"), datasets.Image()
    return datasets.Features(
        {
            "pair": text,
            "split": text,
            "reference": picture,
            "live": picture,
            "mask": picture,
            "ignore": picture,
            "area": number,
            "source": text,
            "revision": number,
            "annotator": text,
        }
    )


def _shard(name: str, items: Sequence[Labelled], features: datasets.Features) -> Files:
    import pyarrow
    from pyarrow import parquet

    buffer = io.BytesIO()
    table = pyarrow.Table.from_pylist([_row(item) for item in items], features.arrow_schema)
    # Pictures are compressed already; a group of rows is what a reader takes at once.
    parquet.write_table(table, buffer, compression="none", row_group_size=64)
    return {name: buffer.getvalue()}


def _row(item: Labelled) -> dict[str, Any]:
    pair, ignore = item.pair, item.ignore()

    def picture(kind: str, data: bytes, suffix: str) -> dict[str, Any]:
        return {"bytes": data, "path": f"{pair.split}_{pair.name}.{kind}{suffix}"}

    return {
        "pair": pair.title,
        "split": pair.split,
        "reference": picture("t0", upright_bytes(pair.reference), pair.reference.path.suffix),
        "live": picture("t1", upright_bytes(pair.live), pair.live.path.suffix),
        "mask": picture("mask", encode_png(decode_rle(item.mask)), ".png"),
        "ignore": None if ignore is None else picture("ignore", encode_png(ignore), ".png"),
        "area": item.mask.area,
        "source": str(item.origin.get("run", "ground truth")),
        "revision": item.origin.get("revision"),
        "annotator": item.origin.get("annotator"),
    }


def _card(pairs: int) -> str:
    return f"""---
task_categories:
- image-segmentation
configs:
- config_name: default
  data_files:
  - split: train
    path: data/train-*.parquet
---

# Change detection, {pairs} pairs of a reference and a live image

`mask` is 255 where the live image has changed, 0 elsewhere; `ignore` is 255 where nothing is to be
scored, null where every pixel is.

```python
from datasets import load_dataset
pairs = load_dataset("DIRECTORY", split="train")
```
"""
