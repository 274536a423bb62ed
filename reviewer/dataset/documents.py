"""Read untrusted text files: JSON, YAML, XML and plain text, each within limits.

Whatever is in them, a refusal is one sentence with the file's name: no reading of pipes and devices
that would never end, no aliases and entities that unpack to more than the file, no nesting that
breaks the reader. What the content means is the matter of the caller.
"""

from __future__ import annotations

import json
import stat
import unicodedata
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import yaml

from reviewer.errors import InvalidInput

MALFORMED = (LookupError, TypeError, ValueError, AttributeError, OverflowError)
"""What code meets that takes a document for something it is not."""
LARGEST_YAML = 64 * 1024
KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def check_regular(path: Path) -> int:
    """Return the size of a regular file, bytes.

    Raises:
        InvalidInput: when it is missing, a loop of links, a folder, or a pipe, socket or device,
            whose reading may never end.
    """
    try:
        about = path.stat()
    except (OSError, ValueError) as error:
        raise InvalidInput(f"{path}: cannot be read, {reason_of(error)}") from error
    if not stat.S_ISREG(about.st_mode):
        kind = KINDS.get(stat.S_IFMT(about.st_mode), "something else")
        raise InvalidInput(f"{path}: is {kind}, not a regular file")
    return about.st_size


def reason_of(error: Exception) -> str:
    """Return a library's error message for a file in one line, or the name of the error."""
    said = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return " ".join(said.split()) or type(error).__name__


def read_text(path: Path) -> str:
    """Return the text of a UTF-8 file, with or without a byte order mark.

    Raises:
        InvalidInput: when it is no regular file, or no UTF-8.
    """
    check_regular(path)
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InvalidInput(f"{path}: cannot be read, {reason_of(error)}") from error
    except UnicodeDecodeError as error:
        raise InvalidInput(f"{path}: is no UTF-8 text, byte {error.start} is odd") from error


def readable(text: str, place: str) -> str:
    """Return a name in one form, NFKC with single spaces.

    Raises:
        InvalidInput: for control characters, surrogates and others that are not seen.
    """
    name = " ".join(unicodedata.normalize("NFKC", text).split())
    if not name.isprintable():
        raise InvalidInput(f"{place}: {text!r} has characters that nobody can read")
    return name


def read_json(path: Path, wanted: str) -> Any:
    """Return what a JSON file holds.

    Args:
        wanted: what it should be, for the message.

    Raises:
        InvalidInput: when it is no JSON, or nested deeper than Python reads.
    """
    try:
        return json.loads(read_text(path))
    except RecursionError as error:
        raise InvalidInput(f"{path}: not {wanted}, it is nested too deeply") from error
    except ValueError as error:
        raise InvalidInput(f"{path}: not {wanted}, it is no JSON: {reason_of(error)}") from error


class _NoAliases(yaml.SafeLoader):
    """A few aliases of aliases are gigabytes, and none is needed here."""

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            raise yaml.YAMLError("aliases are not read")
        return super().compose_node(parent, index)


def read_yaml(path: Path) -> Any:
    """Return what a small YAML file holds.

    Raises:
        InvalidInput: when it is no YAML, has aliases, or is larger than 64 KiB.
    """
    if check_regular(path) > LARGEST_YAML:
        raise InvalidInput(f"{path}: has more than {LARGEST_YAML // 1024} KiB")
    text = read_text(path)
    try:
        return yaml.load(text, _NoAliases)
    except (yaml.YAMLError, RecursionError, *MALFORMED) as error:
        # What PyYAML raises for a scalar that does not fit its tag is no YAMLError.
        raise InvalidInput(f"{path}: is no readable YAML, {reason_of(error)}") from error


class _NoDoctype(ElementTree.TreeBuilder):
    """Entities are declared in a document type; no annotation tool writes one."""

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise ValueError("it declares a document type, which is not read")


def read_xml(path: Path) -> ElementTree.Element:
    """Return the root of an XML file.

    Raises:
        InvalidInput: when it is no XML, or declares a document type (and with it entities).
    """
    check_regular(path)
    parser = ElementTree.XMLParser(target=_NoDoctype())
    try:
        return ElementTree.parse(path, parser).getroot()
    except (OSError, ElementTree.ParseError, *MALFORMED) as error:
        raise InvalidInput(f"{path}: not readable XML, {reason_of(error)}") from error
