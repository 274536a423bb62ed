"""Messages of clicks and of the magnetic lasso: what a tool asks, and the masks it is answered."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from reviewer.app.endpoints.fields import Client, Counts, Key
from reviewer.app.endpoints.messages import Message
from reviewer.words import Side

Coordinate = Annotated[float, Field(ge=0, le=20000, allow_inf_nan=False)]


class ClickPoint(Message):
    """A click on the object (positive) or beside it; pixels of the live image."""

    x: Coordinate
    y: Coordinate
    positive: bool = True


class CandidateMask(Message):
    """A candidate as COCO run-lengths, with the segmenter's own score in [0, 1]."""

    counts: Counts
    score: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]


class ClickChange(Message):
    """What a person clicked on one object; `client` names the window it comes from.

    `previous` is the mask that the last click corrects; a candidate with its score, or a part of
    the ground truth with score 0.
    """

    client: Client
    run: Key | None = None
    picture: Side = "live"
    clicks: list[ClickPoint] = Field(default_factory=list, max_length=200)
    box: tuple[Coordinate, Coordinate, Coordinate, Coordinate] | None = None
    previous: CandidateMask | None = None
    crop: bool = False
    preview: bool = False


class ClickReply(Message):
    """Candidates, best first, and the milliseconds that the segmenter took."""

    candidates: list[CandidateMask]
    model: str
    embed_ms: float
    predict_ms: float


class LivePoint(Message):
    """A point of the reference image in the live image."""

    x: float
    y: float


class EdgePath(Message):
    """A path along edges: corners (x, y) in pixels, from the start to the end."""

    points: list[tuple[int, int]]
