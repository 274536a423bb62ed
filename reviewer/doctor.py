"""The checks of `reviewer doctor`: machine, weights, database, images, disk, browser.

A check is good, a note (something that is not there, and how to get it), or bad (something that is
broken). Only the bad ones change the exit code.
"""

from __future__ import annotations

import os
import platform
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

from reviewer.dataset.files import hash_file
from reviewer.errors import InvalidInput, ReviewerError
from reviewer.extras import EXTRAS
from reviewer.models.weights.presets import PRESETS
from reviewer.store.database import Store
from reviewer.store.integrity import damage, list_image_files
from reviewer.words import Finding

LEAST_FREE = 2 * 2**30
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "firefox", "microsoft-edge")
SHOWN = 5


@dataclass(frozen=True, slots=True)
class Check:
    """One check: its subject, the finding, and what was found."""

    subject: str
    finding: Finding
    found: str


def check_all(db: Path | None, *, deep: bool) -> Iterator[Check]:
    """Yield every check; the database's own only where there is one.

    Args:
        deep: read every image and every fetched file, and compare their hashes.
    """
    yield from check_machine()
    yield from check_models(deep=deep)
    if db is not None and db.exists():
        yield from check_store(db, deep=deep)
    elif db is not None:
        yield Check("database", "note", f"{db}: is not there; `reviewer import` makes one")
    yield from check_disk(db)
    yield check_browser()


def check_machine() -> Iterator[Check]:
    """Report the device and the precision."""
    import torch

    from reviewer.models.device import best_device, choose_precision, free_memory

    device = best_device()
    name = torch.cuda.get_device_name() if device == "cuda" else f"{os.cpu_count()} cores"
    yield Check(
        "reviewer",
        "good",
        f"{version('reviewer')}, Python {platform.python_version()}, torch {torch.__version__}",
    )
    yield Check("device", "good", f"{device}, {name}; nets in {choose_precision('auto', device)}")
    free = free_memory()
    if free is not None:
        yield Check("memory", "good", f"{free / 2**30:.1f} GiB free for weights")
    for library, extra in EXTRAS.items():
        if find_spec(library) is None:
            yield Check(library, "note", f"not installed; pip install 'reviewer[{extra}]'")
        else:
            yield Check(library, "good", _version(library))


def check_models(*, deep: bool) -> Iterator[Check]:
    """Report the weights on this machine, and the command that fetches each missing one."""
    if find_spec("huggingface_hub") is None:
        return  # told among the libraries: no weights can be had without it
    from reviewer.models.weights.fetching import check_noted, find_fetched

    for preset in PRESETS:
        path = find_fetched(preset)
        subject = f"model {preset.name}"
        if path is None:
            yield Check(subject, "note", f"not here; reviewer models fetch {preset.name}")
            continue
        try:
            if deep and preset.is_file:
                check_noted(preset, path)
        except InvalidInput as error:
            yield Check(subject, "bad", str(error))
            continue
        yield Check(subject, "good", str(path))


def check_store(db: Path, *, deep: bool) -> Iterator[Check]:
    """Look for damage in a database, and for images that are gone or have changed."""
    try:
        with Store(db) as store:
            found, files = damage(store), list_image_files(store)
    except ReviewerError as error:
        yield Check("database", "bad", str(error))
        return
    if found:
        yield Check("database", "bad", "; ".join(found[:SHOWN]))
    else:
        yield Check("database", "good", f"{db}, {db.stat().st_size / 2**20:.1f} MiB")
    wrong = []
    for path, sha256 in files:
        if not path.is_file():
            wrong.append(f"{path} is gone")
        elif deep and hash_file(path) != sha256:
            wrong.append(f"{path} has changed since its import")
    if wrong:
        rest = f", and {len(wrong) - SHOWN} more" if len(wrong) > SHOWN else ""
        yield Check("images", "bad", ", ".join(wrong[:SHOWN]) + rest)
    else:
        how = "hashes as imported" if deep else "all there; --deep compares their hashes"
        yield Check("images", "good", f"{len(files)}, {how}")


def check_disk(db: Path | None) -> Iterator[Check]:
    """Report the free space on the disk of the database."""
    folder = (db or Path()).resolve().parent
    while not folder.exists():
        folder = folder.parent
    free = shutil.disk_usage(folder).free
    finding: Finding = "good" if free >= LEAST_FREE else "bad"
    yield Check("disk", finding, f"{free / 2**30:.1f} GiB free in {folder}")


def check_browser() -> Check:
    """Report whether a browser is installed; a server reached over SSH needs none."""
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        return Check("browser", "note", "none here; use the one of your own machine (ssh -L)")
    return Check("browser", "good", found)


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "of unknown version"
