"""Between arrays and what the store keeps: flow and confidence, probabilities, warped references.

A flow is kept on every 4th pixel in 1/32 pixel steps: 640x480 takes about 30 KB, and the warped
reference is made from it when somebody looks. The confidence is kept on the same pixels, as 8-bit
grey. Later stages read what is kept, never the original, so a resumed run gives the same bytes as
an uninterrupted one.
"""

from __future__ import annotations

import zlib

import cv2
import numpy as np

from reviewer.dataset.layers import Packing
from reviewer.dataset.pictures import read_picture
from reviewer.errors import InvalidInput
from reviewer.masks import Mask, decode_rle, encode_rle
from reviewer.models.interfaces import Alignment, Field, Image, ModelFailed
from reviewer.models.warping import inside, warp_image
from reviewer.pipeline.judging import judge, judge_detection
from reviewer.records import Pair, Run
from reviewer.store.layers import StoredAlignment, StoredDetection

Part = tuple[slice, slice]
"""Rows and columns of a picture."""

STRIDE = 4
STEP = 32.0


def pack_flow(flow: Field) -> bytes:
    """Return a flow field (H, W, 2) as bytes: every 4th pixel, 1/32 pixel, compressed."""
    limited = np.clip(np.round(_coarse(flow) * STEP), -32768, 32767).astype("<i2")
    return zlib.compress(limited.tobytes(), 6)


def pack_confidence(confidence: Field) -> bytes:
    """Return a confidence (H, W) in [0, 1] as an 8-bit grey PNG: the means around every 4th pixel.

    Raises:
        ModelFailed: when it holds something else than numbers from 0 to 1.
    """
    # A comparison with NaN is False, so this refuses it as well.
    if not ((confidence >= 0) & (confidence <= 1)).all():
        raise ModelFailed("aligner: gave a confidence that is not in [0, 1] for this pair")
    around = (STRIDE + 1, STRIDE + 1)
    return probability_png(_coarse(cv2.blur(confidence, around, borderType=cv2.BORDER_REPLICATE)))


def unpack_flow(
    data: bytes,
    height: int,
    width: int,
    stride: int = STRIDE,
    part: Part | None = None,
    step: int = 1,
) -> Field:
    """Return the float32 flow field (H, W, 2) of packed bytes, or of a part, rows and columns; with
    `step` at each so many pixels, still in pixels.

    Raises:
        InvalidInput: when the bytes do not fit the size.
    """
    rows, columns = len(_samples(height, stride)), len(_samples(width, stride))
    try:
        values = np.frombuffer(zlib.decompress(data), "<i2").reshape(rows, columns, 2)
    except (zlib.error, ValueError) as error:
        raise InvalidInput(f"flow: does not fit an image of {width}x{height}, {error}") from error
    return _full(values.astype(np.float32) / STEP, height, width, stride, part, step)


def _coarse(field: Field) -> Field:
    """Return the samples of a field (H, W) or (H, W, 2) that are kept."""
    height, width = field.shape[:2]
    x, y = np.meshgrid(_samples(width), _samples(height))
    found = cv2.remap(field, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(found, np.float32)


def _full(
    samples: Field, height: int, width: int, stride: int, part: Part | None = None, step: int = 1
) -> Field:
    """Return the field between its samples: all of it, or a part; at each `step`-th pixel, in the
    middle of those that it stands for."""
    rows, columns = part or (slice(0, height), slice(0, width))
    half = (step - 1) / 2
    x, y = np.meshgrid(
        *(
            (np.arange(s.start, s.stop - step + 1, step, dtype=np.float32) + half) / stride
            for s in (columns, rows)
        )
    )
    full = cv2.remap(samples, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(full, np.float32)


def _samples(length: int, stride: int = STRIDE) -> np.ndarray:
    """Positions of the kept samples: 0, 4, 8 .. up to the last pixel or just beyond."""
    return np.arange(0, length - 1 + stride, stride, dtype=np.float32)


def store_alignment(alignment: Alignment, reference: Image, live: Image) -> StoredAlignment:
    """Pack an alignment, and judge it."""
    flow = pack_flow(alignment.flow)
    warped = warp_image(reference, unpack_flow(flow, *live.shape[:2]))
    judged = judge(alignment, reference, warped, live)
    return StoredAlignment(
        flow,
        STRIDE,
        encode_rle(alignment.valid),
        judged.residual_before,
        judged.residual_after,
        judged.backward_px,
        judged.doubt,
        None if alignment.confidence is None else pack_confidence(alignment.confidence),
    )


def pack_imported_flow(pair: Pair, flow: Field, believed: Mask) -> StoredAlignment:
    """Return an imported alignment as stored: judged like any other."""
    reference, live = read_picture(pair.reference), read_picture(pair.live)
    valid: Mask = believed & inside(flow, *reference.shape[:2])
    return store_alignment(Alignment(flow, valid), reference, live)


def packing(run: Run) -> Packing:
    """Return how imported layers are kept in a run."""
    threshold = float(run.settings["threshold"])
    return Packing(lambda values: store_detection(values, threshold), pack_imported_flow)


def load_flow(alignment: StoredAlignment, part: Part | None = None, step: int = 1) -> Field:
    """Return the kept flow, float32 (H, W, 2), or a part of it; see `unpack_flow`."""
    height, width = alignment.valid.height, alignment.valid.width
    return unpack_flow(alignment.flow, height, width, alignment.flow_stride, part, step)


def load_confidence(alignment: StoredAlignment, part: Part | None = None) -> Field | None:
    """Return the kept confidence, float32 (H, W) in [0, 1], or a part of it; None where the aligner
    has none."""
    if alignment.confidence_png is None:
        return None
    valid = alignment.valid
    samples = _read_grey(alignment.confidence_png)
    return _full(samples, valid.height, valid.width, alignment.flow_stride, part)


def store_detection(probability: Field, threshold: float) -> StoredDetection:
    """Return M_o = probability > threshold, with the probability as an 8-bit PNG.

    The mask is taken from the 8-bit values, so that map and mask never contradict each other.
    """
    levels = _levels(probability)
    mask: Mask = levels > threshold * 255
    changed = encode_rle(mask)
    return StoredDetection(_grey_png(levels), threshold, changed, judge_detection(changed))


def probability_png(probability: Field) -> bytes:
    """Return a probability map as it is kept: an 8-bit grey PNG, 255 = certainly changed."""
    return _grey_png(_levels(probability))


def _levels(probability: Field) -> np.ndarray:
    return np.round(np.clip(probability, 0, 1) * 255).astype(np.uint8)


def _grey_png(levels: np.ndarray) -> bytes:
    ok, data = cv2.imencode(".png", levels, [cv2.IMWRITE_PNG_COMPRESSION, 3])
    assert ok, "OpenCV refused a plain grey image"
    return data.tobytes()


def change_of(detection: StoredDetection) -> Field:
    """Return the probability map, or M_o where only that was imported; float32 (H, W) in [0, 1]."""
    probability = load_probability(detection)
    if probability is None:
        return decode_rle(detection.mask).astype(np.float32)
    return probability


def load_probability(detection: StoredDetection) -> Field | None:
    """Return the probability map, float32 (H, W) in [0, 1]; None when only a mask was imported."""
    if detection.probability_png is None:
        return None
    return _read_grey(detection.probability_png)


def _read_grey(png: bytes) -> Field:
    levels = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_GRAYSCALE)
    return np.asarray(levels, np.float32) / np.float32(255)
