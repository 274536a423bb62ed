"""Find the folders that travel with the code: `static/` (the workbench) and `db/` (migrations).

In a checkout they lie beside the package; in an installed wheel they lie inside it.
"""

from __future__ import annotations

from pathlib import Path

from reviewer.errors import NotFound


def shipped_folder(name: str) -> Path:
    """Return the folder `name` ("static" or "db") of this installation.

    Raises:
        NotFound: when neither the wheel's copy nor the checkout's folder exists.
    """
    package = Path(__file__).resolve().parent
    candidates = (package / "_shipped" / name, package.parent / name)
    for folder in candidates:
        if folder.is_dir():
            return folder
    raise NotFound(f"shipped folder {name!r}: not found in {candidates[0]} nor in {candidates[1]}")
