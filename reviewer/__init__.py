"""Build, review and audit change-detection ground truth."""

from __future__ import annotations

from typing import TYPE_CHECKING

from reviewer.version import VERSION

if TYPE_CHECKING:
    from pathlib import Path

    from reviewer.scripting import Project

__version__ = VERSION


def open(path: str | Path) -> Project:
    """Open a database for scripts and notebooks: `reviewer.open("reviewer.db")`.

    Raises:
        NotFound: when the file does not exist.
        InvalidInput: when it is no database of this program, or a newer one.
    """
    from reviewer.scripting import open_project

    return open_project(path)
