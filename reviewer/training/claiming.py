"""A folder keeps to one training: what it is of is written down, and another one is refused."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from reviewer.atomic import whole_file
from reviewer.errors import Conflict

Identity = dict[str, dict[str, Any]]
"""Settings and hashes, by part: "training", "data" and more; plain JSON values."""


def claim(
    folder: Path,
    identity: Identity,
    *,
    complete: Callable[[Identity, Identity], None] = lambda known, wanted: None,
    hint: Callable[[Identity, Identity], str] = lambda known, wanted: "",
) -> None:
    """Make the folder this training's own, or check that it is.

    Args:
        complete: brings the record of an earlier version up to date.
        hint: what may be tried, from what is known of the folder and what is wanted.

    Raises:
        Conflict: when the folder holds a training with other settings.
    """
    path = folder / "training.json"
    text = json.dumps(identity, indent=1, sort_keys=True)
    if not path.exists():
        with whole_file(path) as file:
            file.write(text.encode())
        return
    known, wanted = json.loads(path.read_text(encoding="utf-8")), json.loads(text)
    complete(known, wanted)
    differing = [
        f"{part} {key}"
        for part in wanted
        for key in sorted({*wanted[part], *known.get(part, {})})
        if known.get(part, {}).get(key) != wanted[part].get(key)
    ]
    if differing:
        raise Conflict(
            f"{folder}: holds a training with another {', '.join(differing[:6])};"
            f" give this one a name of its own with --name{hint(known, wanted)}"
        )
