"""How the command line names a member and its settings: NAME, NAME:PATH, stage.setting=value."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from reviewer.errors import InvalidInput
from reviewer.models.registry import PATH_SETTING
from reviewer.words import MEMBER_STAGES, MemberStage

FILES = "files"
"""Member name for layers that lie in a folder: they are imported, then the run goes on."""


def read_member(option: str, text: str) -> tuple[str, dict[str, Any]]:
    """Return the name and the settings that `NAME` or `NAME:PATH` stands for.

    A PATH that is a directory or file here is kept absolute, anything else is taken for a hub id.

    Raises:
        InvalidInput: when the member takes no path, or its file cannot be read.
    """
    name, _, path = text.partition(":")
    if not path:
        return name, {}
    if name not in PATH_SETTING:
        raise InvalidInput(f"{option} {text}: {name} has no weights, so it takes no path")
    if name == "vocabulary":
        return name, {"words": _read_words(option, Path(path))}
    prefix, _, place = path.rpartition(":")
    found = Path(place).expanduser()
    place = str(found.resolve()) if found.exists() else place
    return name, {PATH_SETTING[name]: f"{prefix}:{place}" if prefix else place}


def read_settings(pairs: Sequence[str]) -> dict[MemberStage, dict[str, Any]]:
    """Return settings by stage from texts such as "search.box_threshold=0.25".

    Values are JSON where they can be, plain text elsewhere.

    Raises:
        InvalidInput: for a text of another form.
    """
    found: dict[MemberStage, dict[str, Any]] = {}
    for text in pairs:
        key, equals, value = text.partition("=")
        stage, dot, name = key.partition(".")
        known = next((known for known in MEMBER_STAGES if known == stage), None)
        if not equals or not dot or not name or known is None:
            raise InvalidInput(
                f"--set {text}: write STAGE.SETTING=VALUE with a stage of"
                f" {', '.join(MEMBER_STAGES)}, such as search.box_threshold=0.25"
            )
        try:
            read = json.loads(value)
        except json.JSONDecodeError:
            read = value
        found.setdefault(known, {})[name] = read
    return found


def _read_words(option: str, path: Path) -> Mapping[str, Any]:
    try:
        words = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InvalidInput(f"{option} vocabulary:{path}: cannot be read, {error}") from error
    if isinstance(words, list):
        words = {"*": words}
    if not isinstance(words, dict):
        raise InvalidInput(
            f'{option} vocabulary:{path}: must be a list of names, or {{"split": [names]}}'
        )
    return words
