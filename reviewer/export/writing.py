"""Write an export part by part: it resumes where it was stopped, and appears whole or not at all.

Until the end everything lies in `.NAME.partial` beside the target, with a journal that has a line a
finished part: hashes of its files, and what it was made of. The same export again takes over the
parts whose files still have those hashes, and which would be made of the same now.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any, TextIO

from reviewer import __version__
from reviewer.dataset.files import hash_file
from reviewer.errors import Conflict, NotFound
from reviewer.export.manifest import pair_entry, write_manifest
from reviewer.export.selection import Labelled
from reviewer.records import Image

JOURNAL = ".journal.jsonl"


@dataclass(frozen=True, slots=True)
class Copy:
    """A file to be copied as it is. Never a link: what is done to an export must not be done to
    the data set."""

    image: Image


Files = Mapping[str, bytes | Copy]
"""Content by path in the export."""


@dataclass(frozen=True, slots=True)
class Part:
    """What is written at once: a pair, or a shard of pairs.

    Attributes:
        files: makes the files of the part.
        entry: more of what the manifest says of each of its pairs.
    """

    name: str
    items: Sequence[Labelled]
    files: Callable[[], Files]
    entry: Mapping[str, Any]


def pair_parts(labelled: Sequence[Labelled], files: Callable[[Labelled], Files]) -> list[Part]:
    """Return a part a pair."""

    def part(item: Labelled) -> Part:
        return Part(item.pair.title, (item,), lambda: files(item), {})

    return [part(item) for item in labelled]


def write_export(
    target: Path,
    form: str,
    settings: Mapping[str, Any],
    parts: Sequence[Part],
    *,
    finish: Callable[[Path], None] = lambda folder: None,
    changed: int = 255,
) -> int:
    """Write all parts, what `finish` adds, and a manifest; return the number of pairs.

    Args:
        finish: writes what is about all pairs together, into the folder it is given.
        changed: the value of changed pixels in masks.

    Raises:
        Conflict: when `target` exists and is not empty.
        NotFound: when an image is gone; what was written until then is taken over the next time.
    """
    if target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise Conflict(f"{target}: exists already; name a new folder")
    work = target.parent / f".{target.name}.partial"
    kept = _take_up(work, {"form": form, "settings": dict(settings), "reviewer": __version__})
    lock = Lock()
    with (work / JOURNAL).open("a", encoding="utf-8") as journal, ThreadPoolExecutor() as pool:

        def write(part: Part) -> list[dict[str, Any]]:
            known = kept.get(part.name)
            if known and known["of"] == _made_of(part) and _intact(work, known["files"]):
                hashes = known["files"]
            else:
                hashes = _write_files(work, part)
                line = {"part": part.name, "of": _made_of(part), "files": hashes}
                with lock:
                    _note(journal, line)
            # The files of a shard are those of its first pair, so that each is named once.
            own = [hashes] + [{}] * (len(part.items) - 1)
            return [
                {**part.entry, **pair_entry(item, files)}
                for item, files in zip(part.items, own, strict=True)
            ]

        try:
            entries = [entry for made in pool.map(write, parts) for entry in made]
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    (work / JOURNAL).unlink()
    wanted = {path for entry in entries for path in entry["files"]}
    for path in [p for p in work.rglob("*") if p.is_file()]:
        if path.relative_to(work).as_posix() not in wanted:
            path.unlink()
    finish(work)
    write_manifest(work, form, settings, entries, changed=changed)
    if target.exists():
        target.rmdir()
    work.replace(target)
    return len(entries)


def _take_up(work: Path, head: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parts that an earlier attempt at the same export finished; else begin anew."""
    path, kept = work / JOURNAL, {}
    wanted = json.dumps(head, sort_keys=True)
    if path.exists():
        first, *lines = path.read_text(encoding="utf-8").split("\n")
        if first == wanted:
            # A line that a kill cut off is no line.
            found = [json.loads(line) for line in lines if line.endswith("}")]
            kept = {line["part"]: line for line in found}
    if not kept and work.exists():
        shutil.rmtree(work)
    work.mkdir(parents=True, exist_ok=True)
    if not kept:
        path.write_text(wanted + "\n", encoding="utf-8")
    return kept


def _note(journal: TextIO, line: Mapping[str, Any]) -> None:
    journal.write(json.dumps(line) + "\n")
    journal.flush()


def _made_of(part: Part) -> str:
    """Fingerprint of what a part is made of."""
    made = [
        [
            item.pair.title,
            item.pair.live.sha256,
            item.pair.reference.sha256,
            item.mask.counts,
            item.ignore_rle,
            dict(item.origin),
        ]
        for item in part.items
    ]
    return hashlib.sha256(json.dumps(made, sort_keys=True).encode()).hexdigest()


def _intact(work: Path, hashes: Mapping[str, str]) -> bool:
    return all((work / p).is_file() and hash_file(work / p) == h for p, h in hashes.items())


def _write_files(work: Path, part: Part) -> dict[str, str]:
    hashes = {}
    for name, content in part.files().items():
        path = work / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(content, Copy):
            try:
                shutil.copyfile(content.image.path, path)
            except FileNotFoundError as error:
                raise NotFound(
                    f"{content.image.path}: is gone, so it cannot be exported; the same command"
                    " goes on when it is back"
                ) from error
            hashes[name] = content.image.sha256
        else:
            path.write_bytes(content)
            hashes[name] = hashlib.sha256(content).hexdigest()
    return hashes


def read_image(image: Image) -> bytes:
    """Return the bytes of an image file.

    Raises:
        NotFound: when it is gone.
    """
    try:
        return image.path.read_bytes()
    except FileNotFoundError as error:
        raise NotFound(f"{image.path}: is gone, so it cannot be exported") from error
