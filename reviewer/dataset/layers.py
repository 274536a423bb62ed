"""Import the output of your own models for existing pairs: flows, change maps, object masks.

Files are `DIR/<split>/<pair>.png|.npy`, or `DIR/<pair>.*` when one split is named. Change maps are
8-bit images (0-255) or `.npy` probabilities; objects are label images (0 = none, k = instance k) or
`.npy` stacks (N, H, W), with names in an optional `<pair>.json`: [{"label": .., "score": ..}, ..].
Flows are Middlebury `.flo` or `.npy` (H, W, 2), live pixel -> reference pixel, with an optional
`<pair>.confidence.npy` in [0, 1].
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from reviewer.dataset.documents import MALFORMED, read_json, readable
from reviewer.dataset.files import (
    image_size,
    read_array,
    read_flow,
    read_grey,
    read_probability,
)
from reviewer.errors import Conflict, InvalidInput, NotFound
from reviewer.masks import Mask, encode_rle
from reviewer.records import ObjectInstance, Pair, Run
from reviewer.store.database import Store
from reviewer.store.layers import StoredAlignment, StoredDetection, load_objects
from reviewer.store.results import Content, StageResult, given_key, save_results
from reviewer.words import LayerKind, Side, Stage

STAGE: dict[LayerKind, Stage] = {
    "alignment": "align",
    "detection": "detect",
    "live-objects": "search",
    "reference-objects": "search",
}
SUFFIXES = (".png", ".npy", ".tif", ".tiff", ".bmp")
FLOW_SUFFIXES = (".flo", ".npy")
LEAST_CONFIDENCE = 0.5


@dataclass(frozen=True, slots=True)
class Packing:
    """How arrays become what is kept (`pipeline.fields`).

    Attributes:
        detection: of a probability map, float32 (H, W) in [0, 1].
        alignment: of a pair, a flow float32 (H, W, 2), and valid pixels bool (H, W).
    """

    detection: Callable[[np.ndarray], StoredDetection]
    alignment: Callable[[Pair, np.ndarray, Mask], StoredAlignment]


@dataclass(frozen=True, slots=True)
class LayerReport:
    """Pairs that got a layer, and pairs without a file."""

    imported: int
    without_file: tuple[str, ...]


def import_layer(
    store: Store, run: Run, kind: LayerKind, folder: Path, pairs: list[Pair], pack: Packing
) -> LayerReport:
    """Read and check every file first, then write: a bad file leaves the run as it was.

    Raises:
        Conflict: when the run has a model of its own for this layer.
        InvalidInput: for a bad file, with its name.
        NotFound: when no pair has a file.
    """
    members = {"align": run.aligner, "detect": run.detector, "search": run.segmenter}
    stage = STAGE[kind]
    if members[stage] != "imported":
        maker = members[stage]
        raise Conflict(f"run {run.name}: its {kind} layer is made by {maker}, not imported")
    suffixes = FLOW_SUFFIXES if kind == "alignment" else SUFFIXES
    files = {pair.id: _find(folder, pair, suffixes) for pair in pairs}
    if not any(files.values()):
        name = f"{pairs[0].name}{suffixes[0]}" if pairs else ""
        example = folder / pairs[0].split / name if pairs else folder
        raise NotFound(f"{folder}: no file for any pair; expected names such as {example}")
    read: dict[int, Content] = {}
    for pair in pairs:
        path = files[pair.id]
        if path is None:
            continue
        if kind == "alignment":
            read[pair.id] = pack.alignment(pair, *_read_flow(path, pair))
        elif kind == "detection":
            probability = read_probability(path, partial(_check_size, path, pair))
            read[pair.id] = pack.detection(probability)
        else:
            side: Side = "live" if kind == "live-objects" else "reference"
            kept = [o for o in load_objects(store, run.id, pair.id) if o.side != side]
            read[pair.id] = [*kept, *_read_objects(path, pair, side)]
    for pair_id, content in read.items():
        key = given_key(repr(content))
        save_results(store, run.id, pair_id, [StageResult(stage, key, 0.0, content)])
    without = tuple(pair.title for pair in pairs if files[pair.id] is None)
    return LayerReport(len(read), without)


def _read_flow(path: Path, pair: Pair) -> tuple[np.ndarray, Mask]:
    """Return a flow and where it is believed: above 0.5 in `<pair>.confidence.npy`, if it is there.

    Raises:
        InvalidInput: when the flow is no float (H, W, 2) of the live image's size.
    """

    def check_flow(shape: tuple[int, ...]) -> None:
        if len(shape) != 3 or shape[2] != 2:
            raise InvalidInput(f"{path}: a flow is (height, width, 2), not {shape}")
        _check_size(path, pair, shape[:2])

    flow = read_flow(path, check_flow)
    believed: Mask = np.asarray(np.isfinite(flow).all(axis=2))
    beside = path.with_name(f"{path.stem}.confidence.npy")

    def check_confidence(shape: tuple[int, ...]) -> None:
        if len(shape) != 2:
            raise InvalidInput(f"{beside}: a confidence is (height, width), not {shape}")
        _check_size(beside, pair, shape)

    if beside.exists():
        confidence = read_array(beside, check_confidence)
        believed = np.asarray(believed & (confidence > LEAST_CONFIDENCE))
    return np.where(believed[..., None], flow, 0).astype(np.float32), believed


def _find(folder: Path, pair: Pair, suffixes: tuple[str, ...]) -> Path | None:
    for parent in (folder / pair.split, folder):
        for suffix in suffixes:
            path = parent / f"{pair.name}{suffix}"
            if path.is_file():
                return path
    return None


def _check_size(path: Path, pair: Pair, shape: tuple[int, ...]) -> None:
    if shape != (pair.live.height, pair.live.width):
        raise InvalidInput(
            f"{path}: is {shape[1]}x{shape[0]} but the live image of pair {pair.title} is"
            f" {pair.live.width}x{pair.live.height}"
        )


def _read_objects(path: Path, pair: Pair, side: Side) -> list[ObjectInstance]:
    rles = [encode_rle(mask) for mask in _read_instances(path, pair)]
    names = path.with_suffix(".json")
    labels = _read_names(names, len(rles)) if names.exists() else [("", 1.0)] * len(rles)
    return [
        ObjectInstance(side, number, label, score, rle)
        for number, (rle, (label, score)) in enumerate(zip(rles, labels, strict=True))
    ]


def _read_instances(path: Path, pair: Pair) -> Iterator[Mask]:
    """Yield the masks of a stack or of a label image one by one: together they may be many times
    the size of the file."""
    if path.suffix.lower() != ".npy":
        _check_size(path, pair, image_size(path))
        labels = read_grey(path)
        yield from (np.asarray(labels == value) for value in np.unique(labels) if value != 0)
        return

    def check_stack(shape: tuple[int, ...]) -> None:
        if len(shape) != 3:
            raise InvalidInput(f"{path}: object masks are (N, height, width), not {shape}")
        _check_size(path, pair, shape[1:])

    yield from (np.asarray(plane != 0) for plane in read_array(path, check_stack))


def _read_names(path: Path, count: int) -> list[tuple[str, float]]:
    wanted = 'a list of {"label": .., "score": ..}'
    content = read_json(path, wanted)
    try:
        names = [(str(item.get("label", "")), float(item.get("score", 1.0))) for item in content]
    except MALFORMED as error:
        raise InvalidInput(f"{path}: not {wanted}, {error!r}") from error
    if len(names) != count:
        raise InvalidInput(f"{path}: names {len(names)} objects, but the masks hold {count}")
    for _, score in names:
        if not 0 <= score <= 1:
            raise InvalidInput(f"{path}: a score lies in [0, 1], but one is {score}")
    return [(readable(label, str(path)), score) for label, score in names]
