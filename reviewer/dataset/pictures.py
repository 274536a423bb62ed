"""Read the images of pairs, and only those that were imported.

Results, masks and verdicts belong to the bytes an image had when it was imported. Its hash is
compared at every reading: a modern processor hashes a gigabyte a second, decoding takes ten times
as long, and a shortcut by size and time would miss a copy that kept both.
"""

from __future__ import annotations

import hashlib

import numpy as np
import numpy.typing as npt

from reviewer.dataset.files import read_rgb
from reviewer.errors import InvalidInput, NotFound
from reviewer.records import Image


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


def read_picture(image: Image) -> npt.NDArray[np.uint8]:
    """Return an image as uint8 RGB (H, W, 3).

    Raises:
        NotFound: when it is gone.
        InvalidInput: when it is not the one that was imported.
    """
    read_bytes(image)
    return read_rgb(image.path)
