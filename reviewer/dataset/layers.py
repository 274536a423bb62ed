"""Bring in what a lab's own models made: change maps and object masks of existing pairs.

Files are `DIR/<split>/<pair>.png|.npy`, or `DIR/<pair>.*` when one split is named. Change maps are
8-bit images (0-255) or `.npy` probabilities; objects are label images (0 = none, k = instance k) or
`.npy` stacks (N, H, W), with names in an optional `<pair>.json`: [{"label": .., "score": ..}, ..].
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from reviewer.dataset.files import read_array, read_grey, read_probability
from reviewer.errors import Conflict, InvalidInput, NotFound
from reviewer.masks import Mask, encode_rle
from reviewer.records import ObjectInstance, Pair, Run, Side
from reviewer.store import runs
from reviewer.store.database import Store
from reviewer.store.runs import StoredDetection

Kind = Literal["detection", "live-objects", "reference-objects"]
SUFFIXES = (".png", ".npy", ".tif", ".tiff", ".bmp")

Pack = Callable[[np.ndarray, float], StoredDetection]


@dataclass(frozen=True, slots=True)
class LayerReport:
    """Pairs that got a layer, and pairs without a file."""

    imported: int
    without_file: tuple[str, ...]


def import_layer(
    store: Store, run: Run, kind: Kind, folder: Path, pairs: list[Pair], pack: Pack
) -> LayerReport:
    """Read and check every file first, then write: a bad file leaves the run as it was.

    Args:
        pack: makes a detection of a probability map and the run's threshold (`pipeline.fields`).

    Raises:
        Conflict: when the run has a model of its own for this layer.
        InvalidInput: for a bad file, with its name.
        NotFound: when no pair has a file.
    """
    member = run.detector if kind == "detection" else run.segmenter
    if member != "imported":
        raise Conflict(f"run {run.name}: its {kind} layer is made by {member}, not imported")
    files = {pair.id: _find(folder, pair) for pair in pairs}
    if not any(files.values()):
        example = folder / pairs[0].split / f"{pairs[0].name}.png" if pairs else folder
        raise NotFound(f"{folder}: no file for any pair; expected names such as {example}")
    threshold = float(run.settings["threshold"])
    side: Side = "live" if kind == "live-objects" else "reference"
    detections: dict[int, StoredDetection] = {}
    objects: dict[int, list[ObjectInstance]] = {}
    for pair in pairs:
        path = files[pair.id]
        if path is None:
            continue
        if kind == "detection":
            probability = read_probability(path)
            _check_size(path, pair, probability.shape)
            detections[pair.id] = pack(probability, threshold)
        else:
            objects[pair.id] = _read_objects(path, pair, side)
    for pair_id, detection in detections.items():
        runs.save_detection(store, run.id, pair_id, detection)
    for pair_id, found in objects.items():
        kept = [o for o in runs.load_objects(store, run.id, pair_id) if o.side != side]
        runs.save_objects(store, run.id, pair_id, [*kept, *found], 0.0)
    without = tuple(pair.title for pair in pairs if files[pair.id] is None)
    return LayerReport(len(detections) + len(objects), without)


def _find(folder: Path, pair: Pair) -> Path | None:
    for parent in (folder / pair.split, folder):
        for suffix in SUFFIXES:
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
