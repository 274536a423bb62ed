"""Write an export part by part: it resumes where it was stopped, and appears whole or not at all.

Until the end everything lies in `.NAME.partial` beside the target, with a journal that has a line a
finished part: hashes of its files, and what it was made of. The same export again takes over the
parts whose files still have those hashes, and which would be made of the same now. A lock keeps
two exports of one target apart.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from os import cpu_count
from pathlib import Path
from threading import Lock
from typing import Any, TextIO

from filelock import FileLock, Timeout

from reviewer import __version__
from reviewer.dataset.files import hash_file
from reviewer.dataset.pictures import upright_bytes
from reviewer.errors import Conflict, InvalidInput
from reviewer.export.manifest import pair_entry, write_manifest
from reviewer.export.selection import Labelled
from reviewer.records import Image

JOURNAL = ".journal.jsonl"
SHARD_PX = 80_000_000
"""Pixels of live images in a shard: 256 pairs of 640x480, six of 12 megapixels."""


@dataclass(frozen=True, slots=True)
class Copy:
    """A picture to be copied, upright. Never a link: what is done to an export must not be done to
    the data set."""

    image: Image


Files = Mapping[str, bytes | Copy]
"""Content by path in the export."""


@dataclass(frozen=True, slots=True)
class Part:
    """A unit of writing: a pair, or a shard of pairs.

    Attributes:
        files: makes the files of the part.
        entry: more of what the manifest says of each of its pairs.
        made_with: what else it is made of, beside pictures and masks: another value, another part.
    """

    name: str
    items: Sequence[Labelled]
    files: Callable[[], Files]
    entry: Mapping[str, Any]
    made_with: str = ""


def pair_parts(
    labelled: Sequence[Labelled],
    files: Callable[[Labelled], Files],
    made_with: Callable[[Labelled], str] = lambda item: "",
) -> list[Part]:
    """Return one part per pair."""

    def part(item: Labelled) -> Part:
        return Part(item.pair.title, (item,), lambda: files(item), {}, made_with(item))

    return [part(item) for item in labelled]


def fitting_shard(labelled: Sequence[Labelled], most: int) -> int:
    """Return how many pairs a shard takes, at most `most`: a shard is made in memory."""
    largest = max((item.mask.height * item.mask.width for item in labelled), default=1)
    return max(1, min(most, SHARD_PX // largest))


def write_export(
    target: Path,
    form: str,
    settings: Mapping[str, Any],
    parts: Sequence[Part],
    *,
    finish: Callable[[], Mapping[str, bytes]] = dict,
    changed: int = 255,
) -> int:
    """Write all parts, what `finish` adds, and a manifest; return the number of pairs.

    Args:
        finish: makes the files that are about all pairs together.
        changed: the value of changed pixels in masks.

    Raises:
        Conflict: when `target` exists and is not empty, or another export is writing it.
        NotFound: when an image is gone; what was written until then is taken over the next time.
        InvalidInput: when an image is not the one that was imported, or two files have one name.
    """
    target = target.resolve()
    target.parent.mkdir(parents=True, exist_ok=True)
    lock = FileLock(target.parent / f".{target.name}.lock")
    try:
        lock.acquire(timeout=0)
    except Timeout as error:
        raise Conflict(f"{target}: another export is writing it") from error
    try:
        return _write(target, form, settings, parts, finish, changed)
    finally:
        lock.release()
        Path(lock.lock_file).unlink(missing_ok=True)


def _write(
    target: Path,
    form: str,
    settings: Mapping[str, Any],
    parts: Sequence[Part],
    finish: Callable[[], Mapping[str, bytes]],
    changed: int,
) -> int:
    if target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise Conflict(f"{target}: exists already; name a new folder")
    work = target.parent / f".{target.name}.partial"
    kept = _take_up(work, {"form": form, "settings": dict(settings), "reviewer": __version__})
    lock, owner = Lock(), dict[str, str]()
    with (
        (work / JOURNAL).open("a", encoding="utf-8") as journal,
        ThreadPoolExecutor(cpu_count() or 1) as pool,
    ):

        def write(part: Part) -> list[dict[str, Any]]:
            known, of = kept.get(part.name), _made_of(part)
            if known and known["of"] == of and _intact(work, known["files"]):
                hashes = known["files"]
                _claim(hashes, part, owner, lock)
            else:
                hashes = _write_files(work, part, owner, lock)
                line = {"part": part.name, "of": of, "files": hashes}
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
    shared = finish()
    for name, content in shared.items():
        (work / name).parent.mkdir(parents=True, exist_ok=True)
        (work / name).write_bytes(content)
    write_manifest(work, form, settings, entries, files=shared, changed=changed)
    if target.exists():
        target.rmdir()
    work.replace(target)
    return len(entries)


def _take_up(work: Path, head: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parts that an earlier attempt at the same export finished; else start over."""
    path, kept = work / JOURNAL, {}
    wanted = json.dumps(head, sort_keys=True)
    if path.exists():
        first, *lines = path.read_text(encoding="utf-8").split("\n")
        if first == wanted:
            for line in lines:
                # A line that a kill or a full disk cut off is no line.
                with suppress(ValueError, TypeError, KeyError):
                    found = json.loads(line)
                    kept[found["part"]] = found
            with path.open("a", encoding="utf-8") as journal:
                journal.write("\n")
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
    return hashlib.sha256(json.dumps([part.made_with, made], sort_keys=True).encode()).hexdigest()


def _intact(work: Path, hashes: Mapping[str, str]) -> bool:
    return all((work / p).is_file() and hash_file(work / p) == h for p, h in hashes.items())


def _write_files(work: Path, part: Part, owner: dict[str, str], lock: Lock) -> dict[str, str]:
    hashes, files = {}, part.files()
    _claim(files, part, owner, lock)
    for name, content in files.items():
        path = work / name
        if not path.resolve().is_relative_to(work):
            raise InvalidInput(f"pair {part.name}: its file {name} would lie outside the export")
        path.parent.mkdir(parents=True, exist_ok=True)
        data = upright_bytes(content.image) if isinstance(content, Copy) else content
        path.write_bytes(data)
        hashes[name] = hashlib.sha256(data).hexdigest()
    return hashes


def _claim(names: Iterable[str], part: Part, owner: dict[str, str], lock: Lock) -> None:
    with lock:
        for name in names:
            other = owner.setdefault(name, part.name)
            if other != part.name:
                raise InvalidInput(
                    f"pair {part.name}: its file {name} is the one of pair {other}, too; export"
                    " their splits one by one with --split"
                )
