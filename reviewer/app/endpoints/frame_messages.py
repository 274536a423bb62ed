"""What a workbench frame and its desk say: when the frame joins, and over the socket afterwards.

What comes from a frame is checked (Pydantic models); what goes to it is ours (typed dictionaries).
static/js/wire.js is generated from both unions.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import (
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    field_validator,
)
from typing_extensions import TypedDict

from reviewer.app.endpoints.fields import Key
from reviewer.app.endpoints.messages import Message
from reviewer.words import PairState, QueueOrder, TeamState

Pixels = Annotated[int, Field(ge=0, le=100_000)]
"""A width on the screen, CSS pixels; 0 where none is known."""


class Joining(Message):
    """In the address of the desk's socket: where the frame is, so that a new desk goes on there.

    Attributes:
        client: nonce of the Viser client around the frame, "" for a frame that stands alone.
        store: the database that pair, run and filters belong to.
        queue: width of the docked queue.
    """

    # A frame outlives its server, so it may be of another version: what is not known is left out.
    model_config = ConfigDict(extra="ignore")

    client: str = ""
    store: str = ""
    pair: int | None = None
    run: str | None = None
    split: str | None = None
    state: PairState | None = None
    team: TeamState | None = None
    order: QueueOrder = "name"
    dark: bool = True
    queue: Pixels = 0

    @field_validator("state", "team", "order", mode="wrap")
    @classmethod
    def _known(cls, value: Any, check: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        try:
            return check(value)
        except ValidationError:
            return cls.model_fields[info.field_name or ""].default


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


FromFrame = Annotated[
    Showing | Step | Changed | RunChosen | ThemeChosen, Field(discriminator="type")
]
"""What a workbench frame may send over the desk's socket."""


class Ready(TypedDict):
    """To the frame that has joined: who is signed in where, and what to show."""

    type: Literal["ready"]
    version: str
    store: str
    annotator: str
    run: str | None
    pair: int | None
    fresh: bool


class Open(TypedDict):
    """To the frame: show this pair, in this run."""

    type: Literal["open"]
    pair: int | None
    run: str | None


class Ahead(TypedDict):
    """To the frame: these pairs are likely to come next."""

    type: Literal["ahead"]
    pairs: list[int]


class End(TypedDict):
    """To the frame: there is no next (1) or no previous (-1) pair in the queue."""

    type: Literal["end"]
    by: int


class Filtered(TypedDict):
    """To the frame: the queue's filters, to keep for another desk."""

    type: Literal["queue"]
    split: str | None
    state: PairState | None
    team: TeamState | None
    order: QueueOrder


class Here(TypedDict):
    """To the frame: who is at a desk just now."""

    type: Literal["here"]
    names: list[str]


class Mapped(TypedDict):
    """To the frame: whether there is a map of the open pair's split."""

    type: Literal["map"]
    there: bool


class Failed(TypedDict):
    """To the frame: why what it asked for could not be done."""

    type: Literal["error"]
    detail: str


ToFrame = Ready | Open | Ahead | End | Filtered | Here | Mapped | Failed
"""What a desk may send to its workbench frame."""
