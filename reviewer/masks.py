"""Binary masks: bool HxW in memory, COCO run-lengths in the store, PNG on disk.

`True` means changed, everywhere. Nothing here reads files; callers pass bytes. Run-lengths are
column-major and compressed as pycocotools does it, so the JavaScript twin (`static/js/rle.js`) and
every COCO tool read the same strings.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from PIL import Image as PillowImage
from pycocotools import mask as coco

from reviewer.errors import InvalidInput

Mask = npt.NDArray[np.bool_]
"""bool (H, W), True = changed."""

Box = tuple[int, int, int, int]


@dataclass(frozen=True, slots=True)
class Rle:
    """A mask as COCO run-lengths, with the numbers lists need so that they never decode.

    Attributes:
        height, width: size of the mask in pixels.
        counts: compressed run-lengths, ASCII.
        area: number of True pixels.
        box_xywh: tight box (x, y, width, height) in pixels; all zero for an empty mask.
    """

    height: int
    width: int
    counts: str
    area: int
    box_xywh: Box


@dataclass(frozen=True, slots=True)
class Crop:
    """The part of a mask inside its tight box: cheap to intersect, cheap to keep.

    Attributes:
        x, y: upper left corner in the full image, pixels.
        pixels: bool (h, w), the mask inside the box.
        area: number of True pixels.
    """

    x: int
    y: int
    pixels: Mask
    area: int

    @property
    def box_xyxy(self) -> Box:
        """Box (x0, y0, x1, y1), x1 and y1 exclusive."""
        height, width = self.pixels.shape
        return self.x, self.y, self.x + width, self.y + height

    def window(self, image: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return the view of a full-size array that lies under this crop."""
        x0, y0, x1, y1 = self.box_xyxy
        return image[y0:y1, x0:x1]


def as_mask(array: npt.ArrayLike, *, name: str = "mask") -> Mask:
    """Return a contiguous bool (H, W) array.

    Raises:
        InvalidInput: when the array is not two-dimensional or not boolean.
    """
    mask = np.ascontiguousarray(array)
    if mask.ndim != 2:
        raise InvalidInput(f"{name}: a mask is (height, width), but the array is {mask.shape}")
    if mask.dtype != np.bool_:
        raise InvalidInput(f"{name}: a mask is bool with True = changed, not {mask.dtype}")
    return mask


def encode_rle(mask: npt.ArrayLike) -> Rle:
    """Encode a bool (H, W) mask."""
    pixels = as_mask(mask)
    height, width = pixels.shape
    if pixels.size == 0:
        raise InvalidInput(f"mask: a mask has at least one pixel, but its size is {width}x{height}")
    # The transposed copy is what pycocotools wants, and OpenCV makes it ten times as fast.
    encoded = coco.encode(cv2.transpose(pixels.view(np.uint8)).T)
    return _measured(height, width, encoded["counts"].decode("ascii"))


def encode_crops(crops: Sequence[Crop], height: int, width: int) -> Rle:
    """Encode the union of crops: only the columns that they lie in are read."""
    if not crops:
        return empty_rle(height, width)
    left, right = min(c.x for c in crops), max(c.box_xyxy[2] for c in crops)
    strip = np.zeros((height, right - left), np.bool_)
    for crop in crops:
        strip[crop.y : crop.box_xyxy[3], crop.x - left : crop.box_xyxy[2] - left] |= crop.pixels
    runs = _run_lengths(encode_rle(strip).counts).tolist()
    runs[0] += left * height
    # Runs are of 0 and 1 in turn; columns after the strip go on with its last 0, or are one more.
    rest = (width - right) * height
    if rest:
        runs = [*runs[:-1], runs[-1] + rest] if len(runs) % 2 else [*runs, rest]
    encoded = coco.frPyObjects({"size": [height, width], "counts": runs}, height, width)
    return _measured(height, width, encoded["counts"].decode("ascii"))


def read_rle(height: int, width: int, counts: str) -> Rle:
    """Check run-lengths from outside and measure them.

    Raises:
        InvalidInput: when size or run-lengths are malformed, or do not add up to height x width.
    """
    if height <= 0 or width <= 0:
        raise InvalidInput(f"run-lengths: size must be positive, but is {width}x{height}")
    if len(counts) > longest_counts(height, width):
        raise InvalidInput(
            f"run-lengths: {len(counts)} characters are more than any mask of {width}x{height} has"
        )
    runs = _runs(counts)
    if any(run < 0 for run in runs):
        raise InvalidInput("run-lengths: a run is negative, the string is damaged")
    total = sum(runs)
    if total != height * width:
        raise InvalidInput(
            f"run-lengths: they cover {total} pixels, but {width}x{height} has {height * width}"
        )
    return _measured(height, width, counts)


def longest_counts(height: int, width: int) -> int:
    """Return an upper bound on the characters of the run-lengths of a mask of a size.

    There is a run a pixel at most, and a run that takes a further character spares 16 pixels.
    """
    return 2 * height * width + 16


def _runs(counts: str) -> list[int]:
    """Expand a COCO run-length string into its runs (a delta code over 6-bit characters)."""
    runs: list[int] = []
    value, shift = 0, 0
    for character in counts:
        code = ord(character) - 48
        if not 0 <= code < 64:
            raise InvalidInput(f"run-lengths: {character!r} is not a run-length character")
        value |= (code & 0x1F) << (5 * shift)
        shift += 1
        if code & 0x20:
            if shift > 7:
                raise InvalidInput("run-lengths: a run is longer than any image")
            continue
        if code & 0x10:
            value -= 1 << (5 * shift)
        if len(runs) > 2:
            value += runs[-2]
        runs.append(value)
        value, shift = 0, 0
    if shift:
        raise InvalidInput("run-lengths: the string ends inside a run")
    return runs


def _measured(height: int, width: int, counts: str) -> Rle:
    encoded = {"size": [height, width], "counts": counts.encode("ascii")}
    area = int(coco.area(encoded))
    x, y, w, h = (int(v) for v in coco.toBbox(encoded)) if area else (0, 0, 0, 0)
    return Rle(height, width, counts, area, (x, y, w, h))


def decode_rle(rle: Rle) -> Mask:
    """Return the bool (H, W) mask of run-lengths."""
    return _painted(_run_lengths(rle.counts), rle.height, rle.width)


def rle_beside(mask: Rle, counts: str | None) -> Rle | None:
    """Return a mask that is stored only as run-lengths next to one of its size; None for none."""
    return None if counts is None else _measured(mask.height, mask.width, counts)


def _run_lengths(counts: str) -> npt.NDArray[np.int64]:
    """Return the runs of a string that was checked (`read_rle`) or made here, 0 first, then 1."""
    codes = np.frombuffer(counts.encode("ascii"), np.uint8).astype(np.int64) - 48
    last = np.flatnonzero((codes & 0x20) == 0)
    first = np.concatenate(([0], last[:-1] + 1))
    digits = last - first + 1
    place = np.arange(len(codes)) - np.repeat(first, digits)
    runs = np.add.reduceat((codes & 0x1F) << (5 * place), first)
    runs -= np.where(codes[last] & 0x10, np.int64(1) << (5 * digits), 0)
    # From the fourth on a run is told by its difference to the one before the last.
    runs[1::2] = np.cumsum(runs[1::2])
    runs[2::2] = np.cumsum(runs[2::2])
    return runs


def _painted(runs: npt.NDArray[np.int64], height: int, width: int) -> Mask:
    """Return the mask of runs that go down the columns: five times as fast as pycocotools."""
    flat = np.repeat((np.arange(len(runs)) & 1).astype(np.uint8), runs)
    return np.asarray(cv2.transpose(flat.reshape(width, height)), np.uint8).view(np.bool_)


def crop_of_rle(rle: Rle) -> Crop | None:
    """Decode run-lengths inside their box only; None for an empty mask.

    A pair has dozens of objects, and each lies in a corner of the image.
    """
    if not rle.area:
        return None
    x, y, width, height = rle.box_xywh
    runs = _run_lengths(rle.counts)
    # Runs go down the columns; only those of the box are painted.
    ends = np.clip(np.cumsum(runs) - x * rle.height, 0, width * rle.height)
    inside = np.diff(ends, prepend=0)
    columns = _painted(inside, rle.height, width)
    return Crop(x, y, np.ascontiguousarray(columns[y : y + height]), rle.area)


def merge_rles(rles: Sequence[Rle], height: int, width: int) -> Mask:
    """Return the union of masks of one size, bool (H, W), without decoding each."""
    if not rles:
        return np.zeros((height, width), np.bool_)
    encoded = [{"size": [r.height, r.width], "counts": r.counts.encode("ascii")} for r in rles]
    return _painted(_run_lengths(coco.merge(encoded)["counts"].decode("ascii")), height, width)


def empty_rle(height: int, width: int) -> Rle:
    """Return the run-lengths of an all-False mask."""
    return encode_rle(np.zeros((height, width), np.bool_))


def encode_png(mask: npt.ArrayLike) -> bytes:
    """Return an 8-bit grey PNG: 255 = changed, 0 = unchanged."""
    buffer = io.BytesIO()
    # Pillow: its zlib writes these four times faster than OpenCV's.
    PillowImage.fromarray(as_mask(mask).astype(np.uint8) * 255).save(
        buffer, "PNG", compress_level=3
    )
    return buffer.getvalue()


PNG_HEAD = b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR"


def png_size(data: bytes, *, name: str = "mask PNG") -> tuple[int, int]:
    """Return (height, width) of a PNG as its header tells, without decoding it.

    Raises:
        InvalidInput: when the bytes do not begin like a PNG.
    """
    size = data[len(PNG_HEAD) : len(PNG_HEAD) + 8]
    if not data.startswith(PNG_HEAD) or len(size) < 8:
        raise InvalidInput(f"{name}: does not begin like a PNG")
    return int.from_bytes(size[4:]), int.from_bytes(size[:4])


def decode_png(data: bytes, *, name: str = "mask PNG") -> Mask:
    """Read a 0/255 (or 0/1) PNG as a mask.

    Raises:
        InvalidInput: when the bytes are no image, or hold values other than one foreground value.
    """
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) if data else None
    except cv2.error as error:  # OpenCV refuses sizes beyond its own limit this way
        raise InvalidInput(f"{name}: not a readable image, {error.err}") from error
    if image is None:
        raise InvalidInput(f"{name}: not a readable image")
    if image.ndim == 3:
        colours = image[..., :3]
        if (colours != colours[..., :1]).any():
            raise InvalidInput(f"{name}: a mask is grey, but this image has colours")
        image = colours[..., 0]
    values = np.unique(image)
    if not set(values.tolist()) <= {0, 255} and not set(values.tolist()) <= {0, 1}:
        raise InvalidInput(
            f"{name}: a mask holds 0 and 255 only, but this image has {len(values)} values"
        )
    return np.ascontiguousarray(image > 0)


def crop_to_box(mask: Mask) -> Crop | None:
    """Cut a mask to its tight box; None for an empty mask."""
    mask, width = np.ascontiguousarray(mask), mask.shape[1]
    # Eight pixels at a time, read once: twice as fast as OpenCV's boundingRect on a cold mask.
    words = mask.view(np.uint64) if width % 8 == 0 else mask.view(np.uint8)
    filled = np.flatnonzero(np.bitwise_or.reduce(words, axis=1))
    if not len(filled):
        return None
    top, bottom = int(filled[0]), int(filled[-1]) + 1
    columns = np.flatnonzero(mask[top:bottom].any(axis=0))
    left, right = int(columns[0]), int(columns[-1]) + 1
    pixels = mask[top:bottom, left:right]
    return Crop(left, top, pixels, int(np.count_nonzero(pixels)))


def components(mask: Mask) -> tuple[npt.NDArray[np.int32], list[Crop]]:
    """Split a mask into 8-connected components.

    Returns:
        labels: int32 (H, W), 0 = background, i + 1 = the i-th component.
        crops: the components in that order.
    """
    pixels = np.ascontiguousarray(mask).view(np.uint8)
    # Named, because OpenCV's default of the same family is 2.7 times slower here; its statistics
    # would cost three times the labels, the outer contours tell the boxes for next to nothing.
    count, labels = cv2.connectedComponentsWithAlgorithm(pixels, 8, cv2.CV_32S, cv2.CCL_GRANA)
    crops: list[Crop] = []
    if count < 2:
        return labels, crops
    contours, tree = cv2.findContours(pixels, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
    # In CCOMP a contour without a parent is an outer one; each component has exactly one, and the
    # label under any of its points says which component it is.
    outer = [contour for contour, node in zip(contours, tree[0], strict=True) if node[3] < 0]
    boxes = {int(labels[c[0, 0, 1], c[0, 0, 0]]): cv2.boundingRect(c) for c in outer}
    for number in range(1, count):
        x, y, width, height = boxes[number]
        part = labels[y : y + height, x : x + width] == number
        crops.append(Crop(x, y, part, int(np.count_nonzero(part))))
    return labels, crops


def union(masks: Iterable[Mask], height: int, width: int) -> Mask:
    """OR masks of one size together; no masks give the empty mask."""
    result = np.zeros((height, width), np.bool_)
    for mask in masks:
        result |= mask
    return result


def intersection_over_union(first: Mask, second: Mask) -> float:
    """Return |A and B| / |A or B| in [0, 1]; two empty masks give 0 (paper-notes rule for 0/0)."""
    either = int(np.count_nonzero(first | second))
    return int(np.count_nonzero(first & second)) / either if either else 0.0


def dilate(mask: Mask, *, size_px: int, times: int = 1) -> Mask:
    """Dilate with a square of odd side `size_px`, `times` times."""
    kernel = np.ones((size_px, size_px), np.uint8)
    grown: npt.NDArray[np.uint8] = cv2.dilate(mask.view(np.uint8), kernel, iterations=times)
    return grown.view(np.bool_)


def shrunk(mask: Mask, step: int) -> Mask:
    """Return a mask `step` times smaller: a pixel for every square of which a quarter is True."""
    if step == 1:
        return mask
    rows, columns = (length // step for length in mask.shape)
    inside = np.ascontiguousarray(mask[: rows * step, : columns * step]).view(np.uint8) * 255
    return np.asarray(cv2.resize(inside, (columns, rows), interpolation=cv2.INTER_AREA)) >= 64


def fill_holes(mask: Mask) -> Mask:
    """Set what is enclosed: pixels without a 4-connected way to the border."""
    outside = np.pad((~mask).view(np.uint8), 1, constant_values=1)
    _, labels = cv2.connectedComponents(outside, connectivity=4)
    return np.ascontiguousarray((labels != labels[0, 0])[1:-1, 1:-1])


def keep_touched(mask: Mask, points: Iterable[tuple[int, int]]) -> Mask:
    """Keep the 8-connected components that lie under one of the points (x, y)."""
    _, labels = cv2.connectedComponents(mask.view(np.uint8), connectivity=8)
    wanted = {int(labels[y, x]) for x, y in points} - {0}
    return np.isin(labels, list(wanted))


def depth(mask: Mask) -> npt.NDArray[np.float32]:
    """Return how far each pixel of a mask lies from the nearest pixel that is not of it, float32
    (H, W) in pixels; what lies beyond the picture is not of it."""
    padded = np.pad(mask.view(np.uint8), 1)
    distance = cv2.distanceTransform(padded, cv2.DIST_L2, 5)[1:-1, 1:-1]
    return np.asarray(distance, np.float32)


def boundary(mask: Mask) -> Mask:
    """Return the pixels of a mask that touch, by a side, what is not in it or the image's rim."""
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    inner = cv2.erode(mask.view(np.uint8), cross, borderType=cv2.BORDER_CONSTANT, borderValue=0)
    return mask & ~np.asarray(inner, np.uint8).view(np.bool_)
