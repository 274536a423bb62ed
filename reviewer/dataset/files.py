"""Read files that come from outside: images, masks, probability maps. Every refusal names the file.

Headers are checked before anything is decoded, so a 60000x60000 PNG costs nothing; PNG chunks are
checked by their sums, JPEGs are decoded, so a truncated file is found at the border and not later.
Pictures that are made here are written by `write_png`.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from PIL import Image as PillowImage
from PIL import UnidentifiedImageError

from reviewer.errors import InvalidInput
from reviewer.masks import Mask

IMAGE_SUFFIXES = {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp"}
LARGEST_PX = 64_000_000

# Our own limit, checked on the header, replaces Pillow's warning at a size of its choosing.
PillowImage.MAX_IMAGE_PIXELS = None


@dataclass(frozen=True, slots=True)
class CheckedImage:
    """An image file that can be read: size in pixels, hash of its bytes."""

    path: Path
    height: int
    width: int
    sha256: str


def list_images(folder: Path, root: Path) -> tuple[dict[str, Path], list[tuple[Path, str]]]:
    """Return the images of a folder by stem, and what was skipped with the reason.

    Raises:
        InvalidInput: for two images of one stem, or a link that leaves `root`.
    """
    found: dict[str, Path] = {}
    skipped = []
    for path in sorted(folder.iterdir()):
        if path.is_dir() or path.name.startswith("."):
            continue
        if path.suffix.lower() not in IMAGE_SUFFIXES:
            skipped.append((path, "not an image"))
            continue
        if not path.resolve().is_relative_to(root.resolve()):
            raise InvalidInput(f"{path}: is a link that leads out of {root}, to {path.resolve()}")
        if path.stem in found:
            raise InvalidInput(
                f"{path}: the name {path.stem!r} is taken by {found[path.stem].name} in that folder"
            )
        found[path.stem] = path
    return found, skipped


def check_image(path: Path) -> CheckedImage:
    """Check that an image can be read, and hash it.

    Raises:
        InvalidInput: when it is no image, too large, truncated or damaged.
    """
    height, width = image_size(path)
    try:
        with PillowImage.open(path) as image:
            if image.format == "PNG":
                image.verify()
            else:
                image.load()
    except (OSError, SyntaxError, ValueError) as error:
        raise InvalidInput(f"{path}: damaged image, {error}") from error
    return CheckedImage(path, height, width, hash_file(path))


def image_size(path: Path) -> tuple[int, int]:
    """Return (height, width) from the header alone.

    Raises:
        InvalidInput: when it is no image, or larger than 64 million pixels.
    """
    try:
        with PillowImage.open(path) as image:
            width, height = image.size
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError) as error:
        raise InvalidInput(f"{path}: not a readable image, {error}") from error
    if height * width > LARGEST_PX:
        raise InvalidInput(
            f"{path}: {width}x{height} is more than {LARGEST_PX // 1_000_000} million pixels"
        )
    return height, width


def hash_file(path: Path) -> str:
    """Return the SHA-256 of a file, hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def read_rgb(path: Path) -> npt.NDArray[np.uint8]:
    """Return a uint8 RGB (H, W, 3) image.

    Raises:
        InvalidInput: when the file is missing, no image, too large or damaged.
    """
    image_size(path)
    try:
        with PillowImage.open(path) as image:
            return np.asarray(image.convert("RGB"))
    except (OSError, SyntaxError, ValueError) as error:
        raise InvalidInput(f"{path}: damaged image, {error}") from error


def write_png(path: Path, picture: npt.NDArray[np.uint8]) -> None:
    """Write a uint8 RGB (H, W, 3) picture, little compressed.

    Raises:
        OSError: when it cannot be written.
    """
    bgr = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
    if not cv2.imwrite(str(path), bgr, [cv2.IMWRITE_PNG_COMPRESSION, 1]):
        raise OSError(f"{path}: could not be written")


def read_grey(path: Path) -> npt.NDArray[Any]:
    """Return a one-channel image as it is stored: bool, 8 or 16 bits, or palette indices.

    Raises:
        InvalidInput: when it is no image, damaged, or has colours.
    """
    image_size(path)
    try:
        with PillowImage.open(path) as image:
            array: npt.NDArray[Any] = np.asarray(image)
    except (OSError, SyntaxError, ValueError) as error:
        raise InvalidInput(f"{path}: damaged image, {error}") from error
    if array.ndim == 3:
        colours = array[..., :3]
        if (colours != colours[..., :1]).any():
            raise InvalidInput(f"{path}: should be grey, but has colours")
        array = array[..., 0]
    return array


def read_mask(path: Path, *, black_is_changed: bool = False) -> Mask:
    """Return a mask image as bool (H, W), True = changed.

    Two values are needed: 0 and one other. Lossy masks (JPEG) and grey borders are refused rather
    than thresholded.

    Raises:
        InvalidInput: when the image is unreadable or holds more than two values.
    """
    array = read_grey(path)
    mask: Mask = array != 0
    # Comparing with the largest value is five times faster than np.unique on a good mask.
    if (array[mask] != array.max()).any():
        values = np.unique(array)
        raise InvalidInput(
            f"{path}: a mask holds 0 and one other value, but this one has {len(values)} values"
            f" from {values[0]} to {values[-1]}"
        )
    return ~mask if black_is_changed else mask


def read_probability(path: Path) -> npt.NDArray[np.float32]:
    """Return a probability map, float32 (H, W) in [0, 1], from an 8-bit image or a .npy file.

    Raises:
        InvalidInput: for another shape or dtype, NaN, or values outside [0, 1].
    """
    if path.suffix.lower() != ".npy":
        array = read_grey(path)
        if array.dtype == np.bool_:
            return np.asarray(array, np.float32)
        if array.dtype != np.uint8:
            raise InvalidInput(f"{path}: a probability image has 8 bits, not {array.dtype}")
        return np.asarray(array, np.float32) / np.float32(255)
    array = read_array(path)
    if array.ndim != 2:
        raise InvalidInput(f"{path}: a probability map is (height, width), not {array.shape}")
    values = np.asarray(array, np.float32)
    if not np.isfinite(values).all() or values.min() < 0 or values.max() > 1:
        raise InvalidInput(
            f"{path}: probabilities lie in [0, 1], but these go from {values.min()} to"
            f" {values.max()}"
        )
    return values


def read_flow(path: Path) -> npt.NDArray[np.float32]:
    """Return a flow field, float32, of a Middlebury `.flo` or an `.npy` file; shape as it is there.

    Raises:
        InvalidInput: when the file cannot be read, or is truncated.
    """
    if path.suffix.lower() != ".flo":
        return read_array(path).astype(np.float32)
    try:
        data = path.read_bytes()
        magic, (width, height) = data[:4], np.frombuffer(data[4:12], "<i4")
        if magic != b"PIEH":
            raise ValueError(f"begins with {magic!r}, not with the mark of .flo files")
        return np.frombuffer(data[12:], "<f4").reshape(height, width, 2).astype(np.float32)
    except (OSError, ValueError) as error:
        raise InvalidInput(f"{path}: not a readable .flo file, {error}") from error


def read_array(path: Path) -> npt.NDArray[Any]:
    """Return a .npy array; pickled objects are refused.

    Raises:
        InvalidInput: when the file is no plain array.
    """
    try:
        array: npt.NDArray[Any] = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise InvalidInput(f"{path}: not a readable .npy array, {error}") from error
    if array.dtype.kind not in "biuf":
        raise InvalidInput(f"{path}: holds {array.dtype}, not numbers")
    return array
