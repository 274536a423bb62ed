"""Commands that take a record: each field of it is an option, as its annotation says."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, TypeVar, get_type_hints

Record = TypeVar("Record")


def options_of(
    record: type[Record],
) -> Callable[[Callable[[Record], None]], Callable[..., None]]:
    """Let a command take its options as one record, a dataclass of annotated fields.

    Typer reads a command's options from its signature, so the command is given that of the record.
    """
    hints = get_type_hints(record, include_extras=True)
    signature = inspect.signature(record)
    parameters = [
        each.replace(annotation=hints[each.name]) for each in signature.parameters.values()
    ]

    def take(command: Callable[[Record], None]) -> Callable[..., None]:
        def call(**given: Any) -> None:
            command(record(**given))

        call.__name__, call.__doc__ = command.__name__, command.__doc__
        call.__annotations__ = {each.name: each.annotation for each in parameters}
        call.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        return call

    return take
