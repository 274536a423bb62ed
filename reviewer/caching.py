"""What is kept under the user's cache folder, and how it stays small."""

from __future__ import annotations

import os
from pathlib import Path


def cache_folder(what: str) -> Path:
    """Return where something is kept: `reviewer/embeddings`, say, under the user's cache folder."""
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "reviewer" / what


def trim_folder(folder: Path, pattern: str, most_bytes: int) -> None:
    """Drop the files unused for longest until they take no more; the newest one always stays."""
    files = sorted((entry.stat().st_mtime, entry) for entry in folder.glob(pattern))
    held = sum(entry.stat().st_size for _, entry in files)
    for _, entry in files[:-1]:
        if held <= most_bytes:
            break
        held -= entry.stat().st_size
        entry.unlink(missing_ok=True)
