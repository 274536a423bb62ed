"""What a workbench frame sends over the desk's socket."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from reviewer.app.fields import Key
from reviewer.app.messages import Message


class Showing(Message):
    """From the frame: it shows this pair."""

    type: Literal["showing"]
    pair: Annotated[int, Field(ge=1, le=2**63 - 1)]


class Step(Message):
    """From the frame: open the next (1) or the previous (-1) pair of the queue."""

    type: Literal["step"]
    by: Literal[1, -1]


class Changed(Message):
    """From the frame: a mask or a state changed, the queue may look different."""

    type: Literal["changed"]


class RunChosen(Message):
    """From the frame: show this run."""

    type: Literal["run"]
    run: Key


class ThemeChosen(Message):
    """From the frame: dark or light."""

    type: Literal["theme"]
    dark: bool


class WindowSize(Message):
    """From the frame: width of the browser window, CSS pixels."""

    type: Literal["window"]
    width: Annotated[int, Field(ge=0, le=100_000)]


FromFrame = Annotated[
    Showing | Step | Changed | RunChosen | ThemeChosen | WindowSize, Field(discriminator="type")
]
"""What a workbench frame may send over the desk's socket."""
