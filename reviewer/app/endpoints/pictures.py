"""Draw the layers of a pair as PNG: pictures as they are, results as coloured overlays.

Pictures (reference, warped, live, difference) are RGB; unseen, detector, objects, DoI, prediction
and ground truth are RGBA overlays that the workbench lays over a picture. Colours are fixed, so
they mean the same in both themes.
"""

from __future__ import annotations

import colorsys
import io
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise

import cv2
import numpy as np
import numpy.typing as npt
from PIL import Image as PillowImage

from reviewer.dataset.files import is_plain_png
from reviewer.dataset.pictures import read_bytes, read_picture, shrunk_picture
from reviewer.errors import NotFound
from reviewer.masks import Crop, Mask, Rle, components, decode_rle, shrunk
from reviewer.pipeline.fields import load_probability
from reviewer.pipeline.stored import (
    live_runs,
    region_crops,
    stored_alignment,
    warped_reference,
)
from reviewer.records import Pair, Run
from reviewer.store.database import Store
from reviewer.store.layers import load_detection, load_objects
from reviewer.store.regions import load_final_mask, load_prediction, load_regions
from reviewer.store.revisions import newest_revision
from reviewer.store.stages_done import pair_overview
from reviewer.words import SIDES, Side

Rgba = npt.NDArray[np.uint8]
Rgb = npt.NDArray[np.uint8]

CHANGE = (255, 76, 60)
PREDICTION = (255, 196, 0)
TRUTH = (0, 214, 143)
VEIL, VEIL_LINE = (10, 14, 20, 170), (150, 162, 178, 190)
KEEP_STOPS = ((0.0, (70, 170, 255)), (0.5, (255, 214, 64)), (1.0, (255, 64, 90)))


def draw_layer(
    store: Store, pair: Pair, run: Run | None, layer: str, *, judged: bool = True, step: int = 1
) -> bytes:
    """Return a layer as PNG bytes.

    Args:
        judged: with people's verdicts in place of the rule's decisions, where there are any.
        step: how many times smaller than the live image.

    Raises:
        NotFound: when the layer needs a run or a stage that is not there.
        InvalidInput: when an image is not the one that was imported.
    """
    if layer in SIDES:
        image = pair.reference if layer == "reference" else pair.live
        if step > 1:
            return _png(shrunk_picture(read_picture(image), step))
        data = read_bytes(image)
        # A plain PNG goes out as it is: the pixels of the file, and nothing to encode.
        return data if is_plain_png(image.path) else _png(read_picture(image))
    if layer == "ground_truth":
        revision = newest_revision(store, pair.id)
        if revision is None:
            raise NotFound(f"pair {pair.title}: has no ground truth yet")
        return _png(_overlay(_mask(revision.mask, step), TRUTH))
    if run is None:
        raise NotFound(f"layer {layer}: needs a run; run the pipeline or import layers first")
    drawers = DRAWERS if judged else {**DRAWERS, **AS_DECIDED}
    return _png(drawers[layer](store, pair, run, step))


def _warped(store: Store, pair: Pair, run: Run, step: int) -> Rgb:
    warped, valid = warped_reference(store, run, pair, step)
    shown = warped.copy()
    shown[~valid] = shown[~valid] // 3
    return shown


def _difference(store: Store, pair: Pair, run: Run, step: int) -> Rgb:
    """Heat of the lightness-normalised difference, dark where the warp is not valid."""
    warped, valid = warped_reference(store, run, pair, step)
    live = shrunk_picture(read_picture(pair.live), step)
    present = cv2.cvtColor(live, cv2.COLOR_RGB2LAB).astype(np.float32)
    past = cv2.cvtColor(warped, cv2.COLOR_RGB2LAB).astype(np.float32)
    if valid.any():
        past += (present[valid].mean(axis=0) - past[valid].mean(axis=0))[None, None]
    distance = np.linalg.norm(present - past, axis=2)
    distance[~valid] = 0
    level = np.clip(distance * 4, 0, 255).astype(np.uint8)
    heat = cv2.applyColorMap(level, cv2.COLORMAP_INFERNO)
    return np.asarray(cv2.cvtColor(heat, cv2.COLOR_BGR2RGB), np.uint8)


def _unseen(store: Store, pair: Pair, run: Run, step: int) -> Rgba:
    """A dark veil over what cannot be compared, hatched so that it shows on a dark picture too."""
    unseen = ~_mask(stored_alignment(store, run, pair).valid, step)
    picture = np.zeros((*unseen.shape, 4), np.uint8)
    picture[unseen] = VEIL
    picture[unseen & _stripes(unseen.shape, 12, 2)] = VEIL_LINE
    return picture


def _detector(store: Store, pair: Pair, run: Run, step: int) -> Rgba:
    """Probability as the strength of the colour, M_o outlined."""
    detection = load_detection(store, run.id, pair.id)
    if detection is None:
        raise NotFound(f"pair {pair.title}: no detection in run {run.name}")
    mask = _mask(detection.mask, step)
    probability = load_probability(detection)
    strength = mask.astype(np.float32) if probability is None else shrunk_picture(probability, step)
    picture = np.zeros((*mask.shape, 4), np.uint8)
    picture[..., :3] = CHANGE
    picture[..., 3] = np.clip(strength * 200, 0, 200).astype(np.uint8)
    picture[_rim(mask)] = (*CHANGE, 255)
    return picture


def _objects(side: Side) -> Callable[[Store, Pair, Run, int], Rgba]:
    def draw(store: Store, pair: Pair, run: Run, step: int) -> Rgba:
        found = [o for o in load_objects(store, run.id, pair.id) if o.side == side]
        if not found and not pair_overview(store, run.id, pair.id).searched:
            raise NotFound(f"pair {pair.title}: objects were not searched in run {run.name}")
        picture = np.zeros((pair.live.height // step, pair.live.width // step, 4), np.uint8)
        for thing in found:
            mask = _mask(thing.mask, step)
            colour = _instance_colour(thing.number)
            picture[mask] = (*colour, 150)
            picture[_rim(mask)] = (*colour, 255)
        return picture

    return draw


def _doi(store: Store, pair: Pair, run: Run, step: int, *, judged: bool = True) -> Rgba:
    """Regions coloured by DoI, hatched where the outcome is to adopt the object."""
    detection = load_detection(store, run.id, pair.id)
    regions = load_regions(store, run.id, pair.id)
    if detection is None or not (
        regions or load_prediction(store, run.id, pair.id, "doi") is not None
    ):
        raise NotFound(f"pair {pair.title}: not integrated in run {run.name}")
    objects = live_runs(store, run.id, pair.id)
    change = decode_rle(detection.mask)
    _, parts = components(change)
    shape = tuple(length // step for length in change.shape)
    hatch = _stripes(shape, 8, 3)
    picture = np.zeros((*shape, 4), np.uint8)
    for stored in sorted(regions, key=lambda r: r.region.doi):
        things, mine = region_crops(stored.region, objects, parts)
        mask = _shrunk_crops([*mine, *(things or [])], (shape[0], shape[1]), step)
        colour = doi_colour(stored.region.doi)
        picture[mask] = (*colour, 140)
        outcome = stored.outcome if judged else stored.region.choice
        if outcome == "adopt":
            picture[mask & hatch] = (*colour, 245)
        elif outcome == "reject":
            picture[mask] = (130, 130, 130, 110)
        picture[_rim(mask)] = (*colour, 255)
    return picture


def _prediction(store: Store, pair: Pair, run: Run, step: int, *, judged: bool = True) -> Rgba:
    """The final mask: the audited one where people gave verdicts."""
    rle = (
        load_final_mask(store, run.id, pair.id)
        if judged
        else load_prediction(store, run.id, pair.id, "doi")
    )
    if rle is None:
        raise NotFound(f"pair {pair.title}: not integrated in run {run.name}")
    return _overlay(_mask(rle, step), PREDICTION)


DRAWERS: dict[str, Callable[[Store, Pair, Run, int], npt.NDArray[np.uint8]]] = {
    "warped": _warped,
    "difference": _difference,
    "unseen": _unseen,
    "detector": _detector,
    "objects_live": _objects("live"),
    "objects_reference": _objects("reference"),
    "doi": _doi,
    "prediction": _prediction,
}
AS_DECIDED: dict[str, Callable[[Store, Pair, Run, int], npt.NDArray[np.uint8]]] = {
    "doi": partial(_doi, judged=False),
    "prediction": partial(_prediction, judged=False),
}
"""As the rule decided: what somebody may see who gives a second opinion."""


def doi_colour(doi: float) -> tuple[int, int, int]:
    """Return the RGB of a DoI: blue at 0, yellow at 0.5, red at 1."""
    for (low, a), (high, b) in pairwise(KEEP_STOPS):
        if doi <= high:
            t = (doi - low) / (high - low)
            return (
                round(a[0] + t * (b[0] - a[0])),
                round(a[1] + t * (b[1] - a[1])),
                round(a[2] + t * (b[2] - a[2])),
            )
    return KEEP_STOPS[-1][1]


def _instance_colour(number: int) -> tuple[int, int, int]:
    """Well separated hues: steps of the golden ratio."""
    r, g, b = colorsys.hsv_to_rgb((0.08 + number * 0.618034) % 1.0, 0.72, 1.0)
    return round(r * 255), round(g * 255), round(b * 255)


def _mask(rle: Rle, step: int) -> Mask:
    return shrunk(decode_rle(rle), step)


def _shrunk_crops(crops: Sequence[Crop], shape: tuple[int, int], step: int) -> Mask:
    """Return the union of crops, `step` times smaller, as `shrunk` makes it of each."""
    result = np.zeros(shape, np.bool_)
    for crop in crops:
        x0, y0, x1, y1 = crop.box_xyxy
        left, top = x0 // step, y0 // step
        size = (-(-y1 // step) - top) * step, (-(-x1 // step) - left) * step
        window = np.zeros(size, np.bool_)
        window[y0 - top * step : y1 - top * step, x0 - left * step : x1 - left * step] = crop.pixels
        small = shrunk(window, step)
        place = result[top : top + small.shape[0], left : left + small.shape[1]]
        place |= small[: place.shape[0], : place.shape[1]]
    return result


def _overlay(mask: Mask, colour: tuple[int, int, int]) -> Rgba:
    picture = np.zeros((*mask.shape, 4), np.uint8)
    picture[mask] = (*colour, 170)
    picture[_rim(mask)] = (*colour, 255)
    return picture


def _stripes(shape: tuple[int, ...], step: int, width: int) -> Mask:
    """Diagonal stripes of a width, one each `step` pixels."""
    height, across = shape
    return np.asarray(np.add.outer(np.arange(height), np.arange(across)) % step < width)


def _rim(mask: Mask) -> Mask:
    pixels = mask.view(np.uint8)
    inner: npt.NDArray[np.uint8] = cv2.erode(
        pixels, np.ones((3, 3), np.uint8), borderType=cv2.BORDER_CONSTANT, borderValue=0
    )
    return np.asarray(pixels != inner)


def _png(picture: npt.NDArray[np.uint8]) -> bytes:
    if picture.shape[2] == 4:
        # Overlays are mostly empty: Pillow's zlib runs over that faster than OpenCV's.
        buffer = io.BytesIO()
        PillowImage.fromarray(picture).save(buffer, "PNG", compress_level=1)
        return buffer.getvalue()
    bgr = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
    ok, data = cv2.imencode(".png", bgr, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    assert ok, "OpenCV refused a plain picture"
    return data.tobytes()
