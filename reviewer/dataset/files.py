"""Read files that come from outside: images, masks, probability maps. Every refusal names the file.

Headers are checked before anything is decoded, so a 60000x60000 PNG costs nothing; PNG chunks are
checked by their sums, JPEGs are decoded, so a truncated file is found at the border and not later.
Pictures are turned as their EXIF orientation says, here and so everywhere; an alpha channel is left
out. Pictures that are made here are written by `write_png`.
"""

from __future__ import annotations

import hashlib
import struct
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tokenize import TokenError
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from PIL import ExifTags
from PIL import Image as PillowImage
from PIL.Image import Transpose

from reviewer.dataset.documents import check_regular, reason_of
from reviewer.errors import InvalidInput

IMAGE_SUFFIXES = {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp"}
LARGEST_PX = 64_000_000
TURNS = {
    2: Transpose.FLIP_LEFT_RIGHT,
    3: Transpose.ROTATE_180,
    4: Transpose.FLIP_TOP_BOTTOM,
    5: Transpose.TRANSPOSE,
    6: Transpose.ROTATE_270,
    7: Transpose.TRANSVERSE,
    8: Transpose.ROTATE_90,
}
"""What puts a picture upright, by its EXIF orientation."""
SIDEWAYS = (TURNS[5], TURNS[6], TURNS[7], TURNS[8])
PNG_EXIF = {"exif", "Raw profile type exif", "xmp", "XML:com.adobe.xmp"}
BROKEN = (
    OSError, SyntaxError, ValueError, LookupError, TypeError, AttributeError, ArithmeticError,
    EOFError, TokenError, MemoryError, RuntimeError, struct.error,
)  # fmt: skip
"""What the readers of Pillow and NumPy raise for damaged files."""

# Our own limit, checked on the header, replaces Pillow's warning at a size of its choosing.
PillowImage.MAX_IMAGE_PIXELS = None
# It warns of tags that it goes on without; what the pixels need still raises.
warnings.filterwarnings("ignore", category=UserWarning, module=r"PIL\.")


@dataclass(frozen=True, slots=True)
class CheckedImage:
    """An image file that can be read: size in pixels as it is shown, hash of its bytes.

    Attributes:
        turned: its EXIF orientation turns or mirrors it.
        transparent: it has an alpha channel or a transparent colour, which is left out.
    """

    path: Path
    height: int
    width: int
    sha256: str
    turned: bool = False
    transparent: bool = False


def list_images(folder: Path, root: Path) -> tuple[dict[str, Path], list[tuple[Path, str]]]:
    """Return the images of a folder by stem, and what was skipped with the reason.

    Raises:
        InvalidInput: for two images of one stem, a name that is no text, or a link that leaves
            `root` or leads nowhere.
    """
    found: dict[str, Path] = {}
    skipped = []
    for path in sorted(folder.iterdir()):
        is_image = path.suffix.lower() in IMAGE_SUFFIXES
        if path.name.startswith(".") or (path.is_dir() and not is_image):
            continue
        if not path.name.isprintable():
            raise InvalidInput(f"{folder}/{path.name!r}: a name of readable characters is needed")
        if path.is_dir() or not is_image:
            skipped.append((path, "is a folder" if path.is_dir() else "not an image"))
            continue
        try:
            place = path.resolve()
        except (OSError, RuntimeError) as error:
            raise InvalidInput(f"{path}: is a loop of links") from error
        if not place.is_relative_to(root.resolve()):
            raise InvalidInput(f"{path}: is a link that leads out of {root}, to {place}")
        if path.stem in found:
            raise InvalidInput(
                f"{path}: the name {path.stem!r} is taken by {found[path.stem].name} in that folder"
            )
        found[path.stem] = path
    return found, skipped


@contextmanager
def _opened(path: Path) -> Iterator[PillowImage.Image]:
    """Open an image within bounds; what goes wrong with its pixels inside the block is named.

    Raises:
        InvalidInput: when it is no regular file, no image, larger than 64 million pixels, damaged.
    """
    check_regular(path)
    try:
        image = PillowImage.open(path)
    except BROKEN as error:
        raise InvalidInput(f"{path}: not a readable image, {reason_of(error)}") from error
    with image:
        width, height = image.size
        if height * width > LARGEST_PX:
            raise InvalidInput(
                f"{path}: {width}x{height} is more than {LARGEST_PX // 1_000_000} million pixels"
            )
        try:
            yield image
        except BROKEN as error:
            raise InvalidInput(f"{path}: damaged image, {reason_of(error)}") from error


def _turn(image: PillowImage.Image) -> Transpose | None:
    # A PNG may keep it behind its pixels, where asking for it would mean decoding them.
    if image.format == "PNG" and not PNG_EXIF & image.info.keys():
        return None
    return TURNS.get(image.getexif().get(ExifTags.Base.Orientation, 1))


def _upright(image: PillowImage.Image) -> PillowImage.Image:
    if image.format != "PNG":
        image.load()  # Pillow turns a TIFF by itself, and then has no orientation left
    turn = _turn(image)
    return image if turn is None else image.transpose(turn)


def _check_depth(image: PillowImage.Image, path: Path) -> None:
    deep = any(";16" in str(tile[3]) for tile in getattr(image, "tile", ()))
    if deep or image.mode[0] in "IF":
        raise InvalidInput(
            f"{path}: has more than 8 bits a channel, of which a picture would show the upper ones;"
            f" scale it first, such as: magick {path.name} -level LOW,HIGH -depth 8 out.png"
        )


def check_image(path: Path) -> CheckedImage:
    """Check that a picture can be read, and hash it.

    Raises:
        InvalidInput: when it is no image, too large, truncated or damaged, or has 16 bits.
    """
    with _opened(path) as image:
        _check_depth(image, path)
        turned, transparent = _turn(image) is not None, image.has_transparency_data
        height, width = _shown_size(image)
        if image.format == "PNG":
            image.verify()
        else:
            image.load()
    return CheckedImage(path, height, width, hash_file(path), turned, transparent)


def image_size(path: Path) -> tuple[int, int]:
    """Return (height, width) as it is shown, from the header alone.

    Raises:
        InvalidInput: when it is no image, or larger than 64 million pixels.
    """
    with _opened(path) as image:
        return _shown_size(image)


def _shown_size(image: PillowImage.Image) -> tuple[int, int]:
    width, height = image.size
    # Pillow gives the size of a TIFF as it is shown.
    lies = image.format != "TIFF" and _turn(image) in SIDEWAYS
    return (width, height) if lies else (height, width)


def is_plain_png(path: Path) -> bool:
    """Say whether every reader sees in a file what `read_rgb` returns: no turn, no alpha channel.

    Raises:
        InvalidInput: when it is no image.
    """
    with _opened(path) as image:
        return image.format == "PNG" and _turn(image) is None and not image.has_transparency_data


def is_turned(path: Path) -> bool:
    """Say whether an EXIF orientation turns or mirrors what a file stores.

    Raises:
        InvalidInput: when it is no image.
    """
    with _opened(path) as image:
        return _turn(image) is not None


def hash_file(path: Path) -> str:
    """Return the SHA-256 of a file, hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def read_rgb(path: Path) -> npt.NDArray[np.uint8]:
    """Return a uint8 RGB (H, W, 3) picture, upright.

    Raises:
        InvalidInput: when the file is missing, no image, too large, damaged, or has 16 bits.
    """
    with _opened(path) as image:
        _check_depth(image, path)
        return np.asarray(_upright(image).convert("RGB"))


def write_png(path: Path, picture: npt.NDArray[np.uint8]) -> None:
    """Write a uint8 RGB (H, W, 3) picture, little compressed.

    Raises:
        OSError: when it cannot be written.
    """
    bgr = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
    if not cv2.imwrite(str(path), bgr, [cv2.IMWRITE_PNG_COMPRESSION, 1]):
        raise OSError(f"{path}: could not be written")


def read_grey(path: Path, *, hint: str = "") -> npt.NDArray[Any]:
    """Return a one-channel image as it is stored: bool, 8 or 16 bits, or palette indices; upright.

    Args:
        hint: the way out when it has colours.

    Raises:
        InvalidInput: when it is no image, damaged, or has colours.
    """
    with _opened(path) as image:
        array: npt.NDArray[Any] = np.asarray(_upright(image))
        colours = image.mode not in ("LA", "PA", "La")
    if array.ndim == 3:
        if colours and (array[..., :3] != array[..., :1]).any():
            raise InvalidInput(f"{path}: should be grey, but has colours{hint}")
        array = array[..., 0]
    return array


Check = Callable[[tuple[int, ...]], None]
"""Refuses a shape; called before what has it is read."""


def read_probability(path: Path, check: Check) -> npt.NDArray[np.float32]:
    """Return a probability map, float32 (H, W) in [0, 1], from an 8-bit image or a .npy file.

    Raises:
        InvalidInput: for another shape or dtype, NaN, or values outside [0, 1].
    """
    if path.suffix.lower() != ".npy":
        check(image_size(path))
        array = read_grey(path)
        if array.dtype == np.bool_:
            return np.asarray(array, np.float32)
        if array.dtype != np.uint8:
            raise InvalidInput(f"{path}: a probability image has 8 bits, not {array.dtype}")
        return np.asarray(array, np.float32) / np.float32(255)

    def check_flat(shape: tuple[int, ...]) -> None:
        if len(shape) != 2 or not all(shape):
            raise InvalidInput(f"{path}: a probability map is (height, width), not {shape}")
        check(shape)

    values = np.asarray(read_array(path, check_flat), np.float32)
    if not np.isfinite(values).all() or values.min() < 0 or values.max() > 1:
        raise InvalidInput(
            f"{path}: probabilities lie in [0, 1], but these go from {values.min()} to"
            f" {values.max()}"
        )
    return values


def read_flow(path: Path, check: Check) -> npt.NDArray[np.float32]:
    """Return a flow field, float32, of a Middlebury `.flo` or an `.npy` file; shape as it is there.

    Raises:
        InvalidInput: when the file cannot be read, or is truncated.
    """
    if path.suffix.lower() != ".flo":
        with np.errstate(over="ignore"):  # what float32 cannot hold becomes infinite
            return read_array(path, check).astype(np.float32)
    check_regular(path)
    try:
        with path.open("rb") as file:
            magic, (width, height) = file.read(4), struct.unpack("<ii", file.read(8))
            if magic != b"PIEH":
                raise ValueError(f"begins with {magic!r}, not with the mark of .flo files")
            if width < 1 or height < 1:
                raise ValueError(f"its size is {width}x{height}")
            check((height, width, 2))
            flow = np.frombuffer(file.read(), "<f4").reshape(height, width, 2)
    except BROKEN as error:
        raise InvalidInput(f"{path}: not a readable .flo file, {reason_of(error)}") from error
    return flow.astype(np.float32)


def read_array(path: Path, check: Check) -> npt.NDArray[Any]:
    """Return a .npy array; pickled objects are refused.

    Raises:
        InvalidInput: when the file is no plain array.
    """
    check_regular(path)
    try:
        # Mapped first: a header that claims more than the file holds is found, and not allocated.
        mapped = np.lib.format.open_memmap(path, mode="r")
        if mapped.dtype.kind not in "biuf":
            raise InvalidInput(f"{path}: holds {mapped.dtype}, not numbers")
        check(mapped.shape)
        return np.array(mapped)
    except BROKEN as error:
        raise InvalidInput(f"{path}: not a readable .npy array, {reason_of(error)}") from error
