"""Load a model of `transformers` from a local directory or by its hub id, with errors that help."""

from __future__ import annotations

import logging
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import torch
from transformers import PreTrainedConfig
from transformers.utils import logging as progress

from reviewer.errors import InvalidInput


def load_pretrained(
    model_class: Any, name: str, option: str, *, types: Collection[str], instead: str
) -> Any:
    """Return a model in float32, all of its weights found.

    Args:
        name: directory or hub id.
        option: how the user named it, such as `--click sam:PATH`; begins every message.
        types: model types that a checkpoint may say it is.
        instead: what the user can do without it.

    Raises:
        InvalidInput: when there is none, it is of another type, or weights are missing.
    """
    folder = Path(name).expanduser()
    # With more or fewer parts than a hub id it can only be a path: no waiting for the hub.
    if not folder.is_dir() and (folder.is_absolute() or len(Path(name).parts) != 2):
        raise InvalidInput(f"{option}: there is no such directory; {instead}")
    source = str(folder) if folder.is_dir() else name
    try:
        with _quiet():
            config, _ = PreTrainedConfig.get_config_dict(source)
            found = config.get("model_type")
            if found not in types:
                wanted = " or ".join(sorted(types))
                raise InvalidInput(f"{option}: holds a model of type {found!r}, not {wanted}")
            model, report = model_class.from_pretrained(
                source, dtype=torch.float32, output_loading_info=True
            )
    except InvalidInput:
        raise
    except Exception as error:  # the libraries below raise a dozen unrelated classes here
        reason = str(error).strip().partition("\n")[0]
        raise InvalidInput(f"{option}: cannot be loaded, {reason}; {instead}") from error
    if report["missing_keys"]:
        first = sorted(report["missing_keys"])[0]
        raise InvalidInput(
            f"{option}: {len(report['missing_keys'])} weights are missing, the first is {first}"
        )
    return model


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
