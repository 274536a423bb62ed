"""Read the images of pairs, and only those that were imported.

Results, masks and verdicts belong to the bytes an image had when it was imported. Its hash is
compared at every reading: a modern processor hashes a gigabyte a second, decoding takes ten times
as long, and a shortcut by size and time would miss a copy that kept both.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from io import BytesIO
from threading import Lock
from typing import TypeVar

import cv2
import numpy as np
import numpy.typing as npt
from PIL import Image as PillowImage
from PIL import ImageOps

from reviewer.dataset.files import is_turned, read_rgb
from reviewer.errors import InvalidInput, NotFound
from reviewer.records import Image

T = TypeVar("T", np.uint8, np.float32)

LARGE_PX = 4_000_000
MOST_DECODED = 4
DECODED: OrderedDict[str, npt.NDArray[np.uint8]] = OrderedDict()
"""Large pictures decoded last, by the hash of their file."""
DECODING = Lock()


def read_bytes(image: Image) -> bytes:
    """Return the bytes of an image file.

    Raises:
        NotFound: when it is gone.
        InvalidInput: when it is not the one that was imported.
    """
    if not image.path.is_file():
        gone = "is no file any more" if image.path.exists() else "is gone"
        raise NotFound(f"{image.path}: {gone}; when it is back, the same command goes on")
    data = image.path.read_bytes()
    if hashlib.sha256(data).hexdigest() != image.sha256:
        raise InvalidInput(
            f"{image.path}: is not the image that was imported, its hash differs; put the old file"
            " back, or import the new one as another split (--split)"
        )
    return data


def upright_bytes(image: Image) -> bytes:
    """Return an image file as every reader shows it the same way round, for sets that leave.

    Its bytes are those of the file, unless an EXIF orientation turns it: then it is turned, and
    encoded again in its own format at the best quality.

    Raises:
        NotFound, InvalidInput: as `read_bytes`.
    """
    data = read_bytes(image)
    if not is_turned(image.path):
        return data
    with PillowImage.open(BytesIO(data)) as stored:
        form, turned = stored.format, ImageOps.exif_transpose(stored)
    buffer = BytesIO()
    best = {"quality": 100, "subsampling": 0} if form == "JPEG" else {}
    turned.save(buffer, form, **best)
    return buffer.getvalue()


def read_picture(image: Image) -> npt.NDArray[np.uint8]:
    """Return an image as uint8 RGB (H, W, 3); a large one, not to be written to, may come from
    memory: layers and clicks ask for it many times.

    Raises:
        NotFound: when it is gone.
        InvalidInput: when it is not the one that was imported.
    """
    read_bytes(image)
    if image.height * image.width < LARGE_PX:
        return read_rgb(image.path)
    with DECODING:
        if image.sha256 not in DECODED:
            DECODED[image.sha256] = read_rgb(image.path)
            DECODED[image.sha256].flags.writeable = False
            while len(DECODED) > MOST_DECODED:
                DECODED.popitem(last=False)
        DECODED.move_to_end(image.sha256)
        return DECODED[image.sha256]


def shrunk_picture(picture: npt.NDArray[T], step: int) -> npt.NDArray[T]:
    """Return a picture or a map `step` times smaller, each pixel the mean of a square."""
    if step == 1:
        return picture
    rows, columns = (length // step for length in picture.shape[:2])
    inside = picture[: rows * step, : columns * step]
    return np.asarray(cv2.resize(inside, (columns, rows), interpolation=cv2.INTER_AREA))
