"""Download weights: the only place that downloads anything.

Hub models go into the hub's own cache, where `transformers` finds them; single files under
`reviewer/weights` in the user's cache folder. An interrupted download resumes.
Every file is checked against the hash that its server states.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
from huggingface_hub import HfApi, hf_hub_download, snapshot_download
from huggingface_hub.errors import (
    GatedRepoError,
    LocalEntryNotFoundError,
    RepositoryNotFoundError,
)
from huggingface_hub.hf_api import ModelInfo, RepoSibling
from tqdm import tqdm

from reviewer.caching import cache_folder
from reviewer.errors import InvalidInput, NotFound, ReviewerError
from reviewer.models.weights.presets import Preset

# What the networks are loaded from; other formats of the same weights stay where they are.
WANTED = (".json", ".safetensors", ".txt", ".model", ".jinja")
FILE_NAMES = {"alpha-clip": "clip_l14_336_grit_20m_4xe.pth"}
"""Names of files whose address does not end in one."""
CHUNK = 1 << 20

Progress = Callable[[int, int, str], None]
"""Called with (bytes so far, bytes in all or 0, file)."""


@dataclass(frozen=True, slots=True)
class Fetched:
    """Where weights lie now, how many bytes they have, and the licence that came with them."""

    path: Path
    size: int
    licence: str


def weights_folder() -> Path:
    """Return where single files are kept."""
    return cache_folder("weights")


def find_fetched(preset: Preset) -> Path | None:
    """Return the path of a preset on this machine; None when it was not fetched."""
    if preset.is_file:
        path = _place(preset)
        return path if path.is_file() else None
    try:
        folder = Path(snapshot_download(preset.source, local_files_only=True))
    except LocalEntryNotFoundError:
        return None
    return folder if any(folder.glob("*.safetensors")) else None


def fetch(
    preset: Preset, progress: Progress = lambda done, total, file: None, endpoint: str | None = None
) -> Fetched:
    """Download what is missing of a preset, and check all of it.

    Args:
        endpoint: another hub, such as a mirror; by default the public one or HF_ENDPOINT.

    Raises:
        NotFound: when the source does not exist or does not answer.
        InvalidInput: when it is gated, or a file does not have the hash it should have.
    """
    if preset.is_file:
        return _fetch_file(preset, progress)
    try:
        return _fetch_model(preset, progress, endpoint)
    except GatedRepoError as error:
        raise InvalidInput(
            f"model {preset.name}: is gated; ask for access on https://huggingface.co/"
            f"{preset.source} and set HF_TOKEN to a token of yours"
        ) from error
    except RepositoryNotFoundError as error:
        raise NotFound(f"model {preset.name}: the hub has no {preset.source}") from error
    except ReviewerError:
        raise
    except Exception as error:  # the hub's library raises its transport's errors as they are
        reason = str(error).strip().partition("\n")[0]
        raise NotFound(
            f"model {preset.name}: cannot be fetched, {reason}; the same command goes on later"
        ) from error


def _fetch_model(preset: Preset, progress: Progress, endpoint: str | None) -> Fetched:
    info = HfApi(endpoint=endpoint).model_info(preset.source, files_metadata=True)
    wanted = _wanted(info.siblings or [])
    total, done = sum(file.size or 0 for file in wanted), 0
    place: Path | None = None
    for file in wanted:
        progress(done, total, file.rfilename)
        report = _reporting(progress, done, total, file.rfilename)
        path = Path(
            hf_hub_download(preset.source, file.rfilename, endpoint=endpoint, tqdm_class=report)
        )
        _check_file(preset, path, file)
        done += file.size or 0
        place = path.parents[file.rfilename.count("/")]
    progress(total, total, "")
    if place is None:
        raise InvalidInput(f"model {preset.name}: {preset.source} holds no weights to load")
    return Fetched(place, total, _licence(info) or preset.licence)


def _reporting(progress: Progress, before: int, total: int, file: str) -> type[tqdm]:
    """Return a bar for the hub's library that draws nothing and tells `progress` every byte."""

    class Report(tqdm):  # type: ignore[misc,unused-ignore]
        def __init__(self, *args: Any, **kwargs: Any) -> None:
            self.seen = int(kwargs.get("initial") or 0)
            kwargs.pop("name", None)
            super().__init__(*args, **{**kwargs, "disable": True})

        def update(self, n: float | None = 1) -> bool | None:
            self.seen += int(n or 0)
            progress(before + self.seen, total, file)
            return None

    return Report


def _wanted(files: Sequence[RepoSibling]) -> list[RepoSibling]:
    """Return the files to load from: those at the top, weights as safetensors."""
    top = [file for file in files if "/" not in file.rfilename]
    return [file for file in top if file.rfilename.endswith(WANTED)]


def _check_file(preset: Preset, path: Path, file: RepoSibling) -> None:
    """Compare a file with what the hub says of it; a damaged one is removed."""
    if file.lfs is not None:
        expected, found = file.lfs.sha256, _sha256(path)
    else:
        content = path.read_bytes()
        # Small files are known by their git hash.
        header = f"blob {len(content)}\0".encode()
        expected, found = file.blob_id or "", hashlib.sha1(header + content).hexdigest()
    if expected != found:
        path.resolve().unlink(missing_ok=True)
        path.unlink(missing_ok=True)
        raise InvalidInput(
            f"model {preset.name}: {file.rfilename} has the hash {found[:12]}, but the hub says"
            f" {expected[:12]}; it was removed, fetch it again"
        )


def _licence(info: ModelInfo) -> str:
    if info.card_data is not None and info.card_data.license:
        return str(info.card_data.license)
    tags = [tag for tag in info.tags or [] if tag.startswith("license:")]
    return tags[0].removeprefix("license:") if tags else ""


def _place(preset: Preset) -> Path:
    return weights_folder() / FILE_NAMES.get(preset.name, preset.source.rpartition("/")[2])


def _fetch_file(preset: Preset, progress: Progress) -> Fetched:
    path = _place(preset)
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(path.suffix + ".part")
        try:
            _download(preset, part, path.name, progress)
        except httpx.HTTPError as error:
            raise NotFound(
                f"model {preset.name}: {preset.source} cannot be fetched, {error}; the same"
                " command goes on later"
            ) from error
        found = _sha256(part)
        if preset.sha256 not in ("", found):
            part.unlink()
            raise InvalidInput(
                f"model {preset.name}: {path.name} has the hash {found[:12]}, but its makers say"
                f" {preset.sha256[:12]}; it was removed, fetch it again"
            )
        note = path.with_suffix(path.suffix + ".sha256")
        note.write_text(f"{found}  {path.name}\n")
        os.replace(part, path)
    check_noted(preset, path)
    return Fetched(path, path.stat().st_size, preset.licence)


def _download(preset: Preset, part: Path, name: str, progress: Progress) -> None:
    done = part.stat().st_size if part.exists() else 0
    headers = {"Range": f"bytes={done}-"} if done else {}
    with httpx.stream(
        "GET", preset.source, headers=headers, follow_redirects=True, timeout=60
    ) as reply:
        if reply.status_code == httpx.codes.REQUESTED_RANGE_NOT_SATISFIABLE:
            return  # all of it is there
        reply.raise_for_status()
        if reply.headers.get("content-type", "").startswith("text/html"):
            raise NotFound(
                f"model {preset.name}: {preset.source} answers with a page, not with a file;"
                " download it with a browser and name the file where it is used"
            )
        goes_on = reply.status_code == httpx.codes.PARTIAL_CONTENT
        done = done if goes_on else 0
        total = done + int(reply.headers.get("content-length", 0))
        with part.open("ab" if goes_on else "wb") as file:
            for chunk in reply.iter_bytes(CHUNK):
                file.write(chunk)
                done += len(chunk)
                progress(done, total, name)


def check_noted(preset: Preset, path: Path) -> None:
    """Compare a single file with the hash recorded at its download.

    Raises:
        InvalidInput: when it has changed since.
    """
    note = path.with_suffix(path.suffix + ".sha256")
    expected = note.read_text().split()[0] if note.exists() else ""
    found = _sha256(path)
    if expected and expected != found:
        raise InvalidInput(
            f"model {preset.name}: {path} has the hash {found[:12]}, but {expected[:12]} was noted"
            " when it was fetched; remove it and fetch it again"
        )


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
