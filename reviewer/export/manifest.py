"""The manifest of an export: every pair with hashes, the settings, the code's version."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from reviewer import __version__
from reviewer.export.selection import Labelled


def pair_entry(item: Labelled, files: Mapping[str, str]) -> dict[str, Any]:
    """Return a pair's entry: where its mask comes from, and the hash of every file by its path."""
    pair = item.pair
    return {
        "pair": pair.title,
        **item.origin,
        "area": item.mask.area,
        "live": pair.live.name,
        "live_sha256": pair.live.sha256,
        "reference": pair.reference.name,
        "reference_sha256": pair.reference.sha256,
        "files": dict(files),
    }


def write_manifest(
    folder: Path,
    form: str,
    settings: Mapping[str, Any],
    entries: Sequence[Mapping[str, Any]],
    *,
    files: Mapping[str, bytes] | None = None,
    changed: int = 255,
) -> None:
    """Write `manifest.json`; the same export gives the same bytes.

    Args:
        files: content of files that are about all pairs together, by path.
        changed: the value of changed pixels in masks.
    """
    manifest = {
        "format": form,
        "changed": changed,
        "unchanged": 0,
        "settings": settings,
        "reviewer": __version__,
        "files": {
            path: hashlib.sha256(content).hexdigest() for path, content in (files or {}).items()
        },
        "pairs": entries,
    }
    (folder / "manifest.json").write_text(json.dumps(manifest, indent=1, sort_keys=True))
