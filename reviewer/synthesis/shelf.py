"""Reference images by number, read on demand and cached while there is room."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import overload

import numpy as np
import numpy.typing as npt

from reviewer.dataset.files import read_rgb

ROOM_BYTES = 1_000_000_000
"""About 1100 images of 640x480."""


class Shelf(Sequence[npt.NDArray[np.uint8]]):
    """A sequence of uint8 RGB images that live on disk."""

    def __init__(self, paths: Sequence[Path], room_bytes: int = ROOM_BYTES) -> None:
        """Remember the paths; nothing is read yet."""
        self._paths, self._size, self._room = list(paths), room_bytes, room_bytes
        self._kept: dict[int, npt.NDArray[np.uint8]] = {}

    def __len__(self) -> int:
        """Return the number of images."""
        return len(self._paths)

    @overload
    def __getitem__(self, number: int) -> npt.NDArray[np.uint8]: ...
    @overload
    def __getitem__(self, number: slice) -> Sequence[npt.NDArray[np.uint8]]: ...
    def __getitem__(
        self, number: int | slice
    ) -> npt.NDArray[np.uint8] | Sequence[npt.NDArray[np.uint8]]:
        """Return an image; raises InvalidInput when its file cannot be read."""
        if isinstance(number, slice):
            return Shelf(self._paths[number], self._room)
        if number not in self._kept:
            image = read_rgb(self._paths[number])
            if self._room < image.nbytes:
                return image
            self._room -= image.nbytes
            self._kept[number] = image
        return self._kept[number]

    def __getstate__(self) -> dict[str, object]:
        """Pickle for a worker process without the images."""
        return {"_paths": self._paths, "_size": self._size, "_room": self._size, "_kept": {}}

    def clear(self) -> None:
        """Drop the cached images; they are read again on demand."""
        self._kept, self._room = {}, self._size
