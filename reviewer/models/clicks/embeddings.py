"""Cache of a click segmenter's embeddings: recent ones in memory, costly ones also on disk.

On disk an embedding is one `.npz` of float16 under the model's id, named by a hash of the pixels:
it serves every database that holds the image. The folder is kept under a size by dropping what was
not used for longest. An embedding gives the same masks whether it was just made or read back,
because it is rounded before it is used first.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections import OrderedDict
from collections.abc import Callable, Hashable
from pathlib import Path
from threading import Lock
from zipfile import BadZipFile

import numpy as np
import numpy.typing as npt

from reviewer.caching import trim_folder
from reviewer.models.interfaces import ClickPictures, ClickSegmenter, Embedding, Image

MEMORY_BYTES = 512 * 2**20
DISK_BYTES = 8 * 2**30
Load = Callable[[], ClickPictures]


class EmbeddingCache:
    """Embeddings of one segmenter; thread-safe, but embedding itself is the caller's one worker."""

    def __init__(
        self,
        segmenter: ClickSegmenter,
        folder: Path | None,
        *,
        memory_bytes: int = MEMORY_BYTES,
        disk_bytes: int = DISK_BYTES,
    ) -> None:
        """Keep costly embeddings under `folder`, or nowhere when it is None."""
        self.segmenter = segmenter
        self._folder = (
            folder / segmenter.model_id if folder and segmenter.keeps_embeddings else None
        )
        self._memory_bytes = memory_bytes
        self._disk_bytes = disk_bytes
        self._held: OrderedDict[Hashable, Embedding] = OrderedDict()
        self._lock = Lock()

    def __contains__(self, key: Hashable) -> bool:
        """Say whether an embedding is in memory."""
        with self._lock:
            return key in self._held

    def get(self, key: Hashable, load: Load) -> Embedding:
        """Return the embedding of `key`; `load` brings what `embed` takes, if it is needed."""
        with self._lock:
            if key in self._held:
                self._held.move_to_end(key)
                return self._held[key]
        embedding = self._read_or_make(load())
        with self._lock:
            self._held[key] = embedding
            held = sum(_size(kept) for kept in self._held.values())
            while held > self._memory_bytes and len(self._held) > 1:
                _, dropped = self._held.popitem(last=False)
                held -= _size(dropped)
        return embedding

    def embed(self, image: Image) -> Embedding:
        """Return the embedding of an image, kept on disk only: for one look at many images."""
        return self._read_or_make(ClickPictures(image))

    def _read_or_make(self, seen: ClickPictures) -> Embedding:
        def make() -> Embedding:
            return self.segmenter.embed(seen.image, seen.other, seen.confidence, seen.change)

        if self._folder is None:
            return make()
        digest = hashlib.blake2b(np.ascontiguousarray(seen.image).data, digest_size=20)
        digest.update(str(seen.image.shape).encode())
        path = self._folder / f"{digest.hexdigest()}.npz"
        found = _read(path)
        if found is None:
            small = {name: _halved(a) for name, a in make().items()}
            _write(path, small)
            trim_folder(self._folder, "*.npz", self._disk_bytes)
            found = small
        return {name: array.astype(np.float32) for name, array in found.items()}


def _size(embedding: Embedding) -> int:
    return sum(array.nbytes for array in embedding.values())


def _halved(array: npt.NDArray[np.float32]) -> npt.NDArray[np.floating]:
    # Sizes and the like are small arrays of whole numbers, which float16 may not hold.
    return array.astype(np.float16) if array.ndim > 2 else array


def _read(path: Path) -> dict[str, npt.NDArray[np.floating]] | None:
    try:
        with path.open("rb") as stream, np.load(stream) as file:
            found = {name: file[name] for name in file.files}
        os.utime(path)
    except FileNotFoundError:
        return None
    except (OSError, ValueError, EOFError, BadZipFile):
        # A damaged file, after a full disk say: it is made again.
        path.unlink(missing_ok=True)
        return None
    return found


def _write(path: Path, arrays: dict[str, npt.NDArray[np.floating]]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".part", delete=False) as file:
        np.savez(file, allow_pickle=False, **arrays)
    os.replace(file.name, path)
