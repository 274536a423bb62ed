"""Make one synthetic pair from a reference image: the same for the same seed and number."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from reviewer.errors import InvalidInput
from reviewer.masks import Mask
from reviewer.synthesis.bank import Bank
from reviewer.synthesis.jitter import displacement, moved, moved_mask, photograph, relight
from reviewer.synthesis.paste import lay, mark, place
from reviewer.synthesis.settings import SynthesisSettings

Rng = np.random.Generator
Image = npt.NDArray[np.uint8]

TRAINING, VALIDATION = 0, 1
"""Streams: pairs of different streams never share their random numbers."""


@dataclass(frozen=True, slots=True)
class SyntheticPair:
    """uint8 RGB (H, W, 3) reference and live, bool (H, W) mask in the frame of live."""

    reference: Image
    live: Image
    mask: Mask


def pair_rng(seed: int, stream: int, number: int) -> Rng:
    """Return the generator of a pair; pairs can be made in any order, by any process."""
    return np.random.default_rng([seed, stream, number])


def make_pair(
    background: Image,
    bank: Bank,
    settings: SynthesisSettings,
    rng: Rng,
    rows: tuple[int, int] | None = None,
) -> SyntheticPair:
    """Paste objects on two copies of a reference image, and make the copies differ otherwise, too.

    Objects that both have come first, so that a change is never hidden beneath one. What only the
    reference has is a change too; its mask is where a person would draw it in the live frame.

    Args:
        rows: rows of the background between which objects lie; anywhere without.
    """
    past = background.astype(np.float32)
    height, width = past.shape[:2]
    objects = bank.objects

    def draw() -> int:
        return int(rng.integers(0, len(objects)))

    for _ in range(int(rng.integers(0, settings.unchanged + 1))):
        lay(past, place(objects[draw()], past, settings, rng, rows))
    present = past.copy()
    gone, come = np.zeros((height, width), np.bool_), np.zeros((height, width), np.bool_)
    for _ in range(int(rng.integers(settings.changes[0], settings.changes[1] + 1))):
        removed = rng.random() < settings.removal
        picture, changed = (past, gone) if removed else (present, come)
        placed = place(objects[draw()], picture, settings, rng, rows)
        lay(picture, placed)
        mark(changed, placed)
    flow = displacement(height, width, settings, rng)
    past, gone = moved(past, flow), moved_mask(gone, flow)
    past, present = relight(past, settings, rng), relight(present, settings, rng)
    past_is_blurred = bool(rng.random() < 0.7)
    return SyntheticPair(
        photograph(past, settings, rng, blurred=past_is_blurred),
        photograph(present, settings, rng, blurred=not past_is_blurred),
        come | gone,
    )


def numbered_pair(
    references: Sequence[Image],
    bank: Bank,
    settings: SynthesisSettings,
    *,
    seed: int,
    stream: int,
    number: int,
    side: int | None = None,
) -> SyntheticPair:
    """Return pair `number` of a stream: of a whole reference image, or of a square of it."""
    rng = pair_rng(seed, stream, number)
    background = references[int(rng.integers(0, len(references)))]
    rows = None
    if settings.rows is not None:
        low, high = (round(share * len(background)) for share in settings.rows)
        rows = low, high
    if side is not None:
        background, top = crop(background, side, rng)
        rows = rows and (rows[0] - top, rows[1] - top)
    return make_pair(background, bank, settings, rng, rows)


def crop(image: Image, side: int, rng: Rng) -> tuple[Image, int]:
    """Cut a random square out of an image; its sides are not swapped and nothing is stretched.

    Returns:
        The square, and the row of the image at its top.

    Raises:
        InvalidInput: when the image is smaller than the square.
    """
    height, width = image.shape[:2]
    if min(height, width) < side:
        raise InvalidInput(f"crop of {side} pixels: the reference image is only {width}x{height}")
    y, x = int(rng.integers(0, height - side + 1)), int(rng.integers(0, width - side + 1))
    return image[y : y + side, x : x + side], y
