"""Load a model of `transformers` from a local directory or the hub's cache, with errors that help.

Nothing here downloads: that is what `reviewer models fetch` is for.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import torch
from huggingface_hub import snapshot_download
from huggingface_hub.errors import HFValidationError, LocalEntryNotFoundError
from safetensors import safe_open
from transformers import PreTrainedConfig
from transformers.utils import logging as progress

from reviewer.errors import InvalidInput
from reviewer.models.device import free_memory


def load_pretrained(
    model_class: Any,
    name: str,
    option: str,
    *,
    types: Collection[str],
    instead: str,
    dtype: torch.dtype = torch.float32,
) -> Any:
    """Return a model with all of its weights found; nothing is downloaded.

    Args:
        name: directory, or hub id of a model that `reviewer models fetch` brought.
        option: how the user named it, such as `--click sam:PATH`; begins every message.
        types: model types that a checkpoint may say it is.
        instead: what the user can do without it.
        dtype: in which its weights are held.

    Raises:
        InvalidInput: when there is none, it is of another type, weights are missing, or they do
            not fit into the memory there is.
    """
    source = find_snapshot(name, option, instead)
    try:
        with _quiet():
            config, _ = PreTrainedConfig.get_config_dict(str(source))
            found = config.get("model_type")
            if found not in types:
                wanted = " or ".join(sorted(types))
                raise InvalidInput(f"{option}: holds a model of type {found!r}, not {wanted}")
            check_memory(source, dtype, option, instead)
            model, report = model_class.from_pretrained(
                str(source), dtype=dtype, output_loading_info=True, local_files_only=True
            )
    except InvalidInput:
        raise
    except Exception as error:  # the libraries below raise a dozen unrelated classes here
        raise _not_loaded(option, error, instead) from error
    if report["missing_keys"]:
        first = sorted(report["missing_keys"])[0]
        raise InvalidInput(
            f"{option}: {len(report['missing_keys'])} weights are missing, the first is {first}"
        )
    return model


def load_beside(loader: Any, name: str, option: str, instead: str) -> Any:
    """Return a model's companion: a tokenizer or a processor.

    Raises:
        InvalidInput: when it is not there, or cannot be read.
    """
    source = find_snapshot(name, option, instead)
    try:
        with _quiet():
            return loader.from_pretrained(str(source), local_files_only=True)
    except Exception as error:  # as above
        raise _not_loaded(option, error, instead) from error


def find_snapshot(name: str, option: str, instead: str) -> Path:
    """Return the folder of a local directory or of a hub id that was fetched before.

    Raises:
        InvalidInput: when there is no such directory, and no such model in the hub's cache.
    """
    folder = Path(name).expanduser()
    if folder.is_dir():
        return folder
    # With more or fewer parts than a hub id it can only be a path.
    if folder.is_absolute() or len(Path(name).parts) != 2:
        raise InvalidInput(f"{option}: there is no such directory; {instead}")
    try:
        return Path(snapshot_download(name, local_files_only=True))
    except (LocalEntryNotFoundError, HFValidationError) as error:
        raise InvalidInput(
            f"{option}: is not on this machine; `reviewer models fetch {name}` brings it;"
            f" or {instead}"
        ) from error


def check_memory(folder: Path, dtype: torch.dtype, option: str, instead: str) -> None:
    """Refuse a model whose weights alone are more than the memory that is free.

    Raises:
        InvalidInput: with both figures.
    """
    values = 0
    for file in folder.glob("*.safetensors"):
        with safe_open(file, framework="pt") as tensors:
            values += sum(math.prod(tensors.get_slice(key).get_shape()) for key in tensors.keys())
    needed, free = values * dtype.itemsize, free_memory()
    if free is not None and needed > free:
        raise InvalidInput(
            f"{option}: its weights take {needed / 2**30:.1f} GiB in {dtype}, but"
            f" {free / 2**30:.1f} GiB are free; {instead}"
        )


def _not_loaded(option: str, error: Exception, instead: str) -> InvalidInput:
    reason = str(error).strip().partition("\n")[0]
    return InvalidInput(f"{option}: cannot be loaded, {reason}; {instead}")


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep the loader's progress bars and its note on "sam2_video" off the terminal."""
    log = logging.getLogger("transformers.configuration_utils")
    level, shown = log.level, progress.is_progress_bar_enabled()
    log.setLevel(logging.ERROR)
    progress.disable_progress_bar()  # type: ignore[no-untyped-call]
    try:
        yield
    finally:
        log.setLevel(level)
        if shown:
            progress.enable_progress_bar()  # type: ignore[no-untyped-call]
