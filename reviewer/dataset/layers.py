"""Bring in what a lab's own models made: flows, change maps and object masks of existing pairs.

Files are `DIR/<split>/<pair>.png|.npy`, or `DIR/<pair>.*` when one split is named. Change maps are
8-bit images (0-255) or `.npy` probabilities; objects are label images (0 = none, k = instance k) or
`.npy` stacks (N, H, W), with names in an optional `<pair>.json`: [{"label": .., "score": ..}, ..].
Flows are Middlebury `.flo` or `.npy` (H, W, 2), live pixel -> reference pixel, with an optional
`<pair>.confidence.npy` in [0, 1].
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from reviewer.dataset.files import read_array, read_flow, read_grey, read_probability
from reviewer.errors import Conflict, InvalidInput, NotFound
from reviewer.masks import Mask, encode_rle
from reviewer.records import ObjectInstance, Pair, Run, Side
from reviewer.store.database import Store
from reviewer.store.layers import StoredAlignment, StoredDetection, load_objects
from reviewer.store.results import Content, Stage, StageResult, given_key, save_results

Kind = Literal["alignment", "detection", "live-objects", "reference-objects"]
STAGE: dict[Kind, Stage] = {
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
    store: Store, run: Run, kind: Kind, folder: Path, pairs: list[Pair], pack: Packing
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
            probability = read_probability(path)
            _check_size(path, pair, probability.shape)
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
    flow = read_flow(path)
    if flow.ndim != 3 or flow.shape[2] != 2:
        raise InvalidInput(f"{path}: a flow is (height, width, 2), not {flow.shape}")
    _check_size(path, pair, flow.shape[:2])
    believed: Mask = np.asarray(np.isfinite(flow).all(axis=2))
    beside = path.with_name(f"{path.stem}.confidence.npy")
    if beside.exists():
        confidence = read_array(beside)
        if confidence.ndim != 2:
            raise InvalidInput(f"{beside}: a confidence is (height, width), not {confidence.shape}")
        _check_size(beside, pair, confidence.shape)
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
    masks = _read_instances(path)
    names = path.with_suffix(".json")
    labels = _read_names(names, len(masks)) if names.exists() else [("", 1.0)] * len(masks)
    objects = []
    for number, (mask, (label, score)) in enumerate(zip(masks, labels, strict=True)):
        _check_size(path, pair, mask.shape)
        objects.append(ObjectInstance(side, number, label, score, encode_rle(mask)))
    return objects


def _read_instances(path: Path) -> list[Mask]:
    if path.suffix.lower() == ".npy":
        stack = read_array(path)
        if stack.ndim != 3:
            raise InvalidInput(f"{path}: object masks are (N, height, width), not {stack.shape}")
        return [np.asarray(plane != 0) for plane in stack]
    labels = read_grey(path)
    return [np.asarray(labels == value) for value in np.unique(labels) if value != 0]


def _read_names(path: Path, count: int) -> list[tuple[str, float]]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        names = [(str(item.get("label", "")), float(item.get("score", 1.0))) for item in content]
    except (OSError, ValueError, AttributeError, TypeError) as error:
        raise InvalidInput(
            f'{path}: must be a list of {{"label": .., "score": ..}}, {error}'
        ) from error
    if len(names) != count:
        raise InvalidInput(f"{path}: names {len(names)} objects, but the masks hold {count}")
    for _, score in names:
        if not 0 <= score <= 1:
            raise InvalidInput(f"{path}: a score lies in [0, 1], but one is {score}")
    return names
