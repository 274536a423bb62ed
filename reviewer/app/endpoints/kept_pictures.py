"""Layers drawn before: the last ones in memory, previews of large pictures on disk as well.

On disk a preview is a PNG named by a hash of what it shows (the files' own hashes, the results'
version), so that a large pair that was opened once is there at once, after a restart too. The
folder is kept under a size by dropping what was not used for longest.
"""

from __future__ import annotations

import hashlib
import os
from collections import OrderedDict
from pathlib import Path
from threading import Lock

from reviewer.atomic import whole_file
from reviewer.caching import trim_folder

CACHED_PICTURES = 160
DISK_BYTES = 2**30
Key = tuple[object, ...]


class PictureCache:
    """Cache of the layers drawn last, so that going back is free; thread-safe."""

    def __init__(
        self, folder: Path, size: int = CACHED_PICTURES, disk_bytes: int = DISK_BYTES
    ) -> None:
        self._folder = folder
        self._size = size
        self._disk_bytes = disk_bytes
        self._pictures: OrderedDict[Key, bytes] = OrderedDict()
        self._lock = Lock()

    def get(self, key: Key) -> bytes | None:
        """Return a picture, None when it is not there."""
        with self._lock:
            if key in self._pictures:
                self._pictures.move_to_end(key)
            return self._pictures.get(key)

    def put(self, key: Key, picture: bytes) -> None:
        """Keep a picture, and drop the one unused for longest when there are too many."""
        with self._lock:
            self._pictures[key] = picture
            if len(self._pictures) > self._size:
                self._pictures.popitem(last=False)

    def recall(self, key: Key) -> bytes | None:
        """Return a preview from disk, None when it is not there."""
        path = self._path(key)
        try:
            found = path.read_bytes()
            os.utime(path)
        except FileNotFoundError:
            return None
        return found

    def keep(self, key: Key, picture: bytes) -> None:
        """Keep a preview on disk, and drop those unused for longest when they take too much."""
        path = self._path(key)
        with whole_file(path) as file:
            file.write(picture)
        with self._lock:
            trim_folder(path.parent, "*.png", self._disk_bytes)

    def _path(self, key: Key) -> Path:
        return (
            self._folder / f"{hashlib.blake2b(repr(key).encode(), digest_size=20).hexdigest()}.png"
        )
