"""The API's typed messages: requests and answers."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import Path
from pydantic import BaseModel, ConfigDict, Field

from reviewer.app.endpoints.fields import Comment, Counts, Key, ListedReason, Phrase, Word
from reviewer.words import (
    Choice,
    Opinion,
    PairLayer,
    PairState,
    ProposalSource,
    QueueOrder,
    Reason,
    ReviewState,
    Standing,
    TeamState,
    Verdict,
    WalkOrder,
)

Id = Annotated[int, Path(ge=1, le=2**63 - 1)]
"""The key of a pair, a region .. in a path."""

Number = Annotated[int, Path(ge=0, le=10**6)]
"""The number of a label .. within its pair, in a path."""


class Message(BaseModel):
    """Base of all messages: unknown fields are refused."""

    model_config = ConfigDict(extra="forbid")


class Problem(Message):
    """An error (RFC 9457): what was wrong, by which rule, where."""

    type: str
    status: int
    detail: str


class Me(Message):
    """The signed-in annotator, and which segmenter answers clicks."""

    annotator: str
    clicks: str


class RunInfo(Message):
    """A run to look at."""

    id: int
    name: str
    aligner: str
    detector: str
    segmenter: str


class SplitProgress(Message):
    """A split and how far the annotator is."""

    name: str
    pairs: int
    finished: int


class PairSummary(Message):
    """A row of the queue."""

    id: int
    split: str
    name: str
    state: PairState
    team: TeamState
    revision: int
    truth_px: int | None
    change_px: int | None
    max_doi: float | None
    inspect: int
    reviewers: int
    doubt: str


class PairPage(Message):
    """A page of the queue."""

    total: int
    pairs: list[PairSummary]


class RegionInfo(Message):
    """A region under DoI: the terms of the equation, the decision, the newest verdict; and F of the
    pair by what becomes of this region, where there is ground truth (null: both are empty)."""

    id: int
    number: int
    label: str
    overlap_px: int
    f_b: int
    iou: float
    doi: float
    choice: Choice
    inspect: bool
    reason: Reason
    box_xyxy: tuple[int, int, int, int] | None
    has_object: bool
    f_if: dict[str, float | None]
    verdict: Verdict | None
    audited_by: str | None
    verdict_reason: str
    comment: str


class ProposalInfo(Message):
    """A proposed mask as COCO run-lengths of the live image's size, and what became of it; `also`
    names the sources that propose nearly the same, `likelihood` orders the list."""

    key: str
    source: ProposalSource
    run: str
    number: int
    label: str
    score: float | None
    region_id: int | None
    area: int
    box_xyxy: tuple[int, int, int, int]
    counts: str
    outcome: str | None
    likelihood: float
    also: list[ProposalSource]


class DoubtfulRegionInfo(Message):
    """A region that waits for a verdict; pixels that flipping its decision gains (null: not known),
    and whether somebody's verdict opposes the decision."""

    region: int
    pair: int
    split: str
    name: str
    doi: float
    gain_px: int | None
    opposed: bool


class WalkQuery(Message):
    """Which regions wait for a verdict, and in what order."""

    run: Key | None = None
    order: WalkOrder = "threshold"
    opinion: Opinion = "first"
    limit: Annotated[int, Field(ge=1, le=5000)] = 100


class Reasons(Message):
    """The reasons that are offered with a verdict, in order."""

    reasons: Annotated[list[ListedReason], Field(max_length=400)]


class ScoreInfo(Message):
    """Pixel counts and scores of one method on a pair; `unseen` is the share of pixels that the run
    has not seen, and are in no count, `unseen_objects` how many changed objects lie there whole."""

    tp: int
    fp: int
    fn: int
    tn: int
    precision: float
    recall: float
    f_score: float
    unseen: float
    unseen_objects: int


class AlignmentInfo(Message):
    """How an alignment was judged: shares, grey levels 0..255, pixels; why it is doubted, or ""."""

    valid_fraction: float
    residual_before: float
    residual_after: float
    backward_px: float | None
    doubt: str


class LabelInfo(Message):
    """What was said of a component of M_o (null: of the whole mask), and what is searched for."""

    number: int
    component: int | None
    raw: str
    label: str
    note: str
    edited_by: str | None


class LabelChange(Message):
    """A name to search for in place of another one; "" searches for nothing."""

    run: Key | None = None
    label: Phrase


class TruthInfo(Message):
    """The revision that counts as ground truth, by what it stands, who said so, and who has drawn
    newer revisions since."""

    revision: int
    standing: Standing
    said_by: list[str]
    changed_by: list[str]


class SkipInfo(Message):
    """Who skipped a pair, and why."""

    annotator: str
    reason: str


class SweepInfo(Message):
    """The tiles of a picture, and the numbers of those that the annotator has looked at from close
    by; they count row by row from the top left."""

    columns: int
    rows: int
    swept: list[int]


class PairDetail(Message):
    """Everything the workbench needs to open a pair, except pixels."""

    id: int
    split: str
    name: str
    height: int
    width: int
    reference: str
    live: str
    viewpoint_distance: float | None
    revision: int
    state: PairState
    truth: TruthInfo | None
    run: str | None
    layers: list[PairLayer]
    version: str
    doubt: str
    skip: SkipInfo | None
    alignment: AlignmentInfo | None
    labels: list[LabelInfo]
    reads_labels: bool
    regions: list[RegionInfo]
    scores: dict[str, ScoreInfo]
    sweep: SweepInfo


class RleMask(Message):
    """A mask as COCO compressed run-lengths."""

    height: Annotated[int, Field(gt=0, le=20000)]
    width: Annotated[int, Field(gt=0, le=20000)]
    counts: Counts


class MaskReply(Message):
    """The newest ground truth; revision 0 and all-zero when there is none."""

    revision: int
    mask: RleMask
    ignore: str | None
    annotator: str | None
    created_at: str | None

    @classmethod
    def empty(cls, height: int, width: int, counts: str) -> MaskReply:
        """The reply for a pair without ground truth."""
        mask = RleMask(height=height, width=width, counts=counts)
        return cls(revision=0, mask=mask, ignore=None, annotator=None, created_at=None)


class OpenedPair(Message):
    """What opens a pair: all of it as it was at one moment."""

    pair: PairDetail
    mask: MaskReply
    proposals: list[ProposalInfo]


class MaskChange(Message):
    """A mask to commit; the revision it was made from stands in If-Match."""

    mask: RleMask
    ignore: Counts | None = None
    active_seconds: Annotated[float, Field(ge=0, le=86400, allow_inf_nan=False)] = 0.0
    tool_log: Annotated[list[dict[str, Any]], Field(max_length=2000)] = []


class Committed(Message):
    """The revision that a commit made."""

    revision: int


class StateChange(Message):
    """A new review state, with the seconds of work since the last saved mask."""

    state: ReviewState
    active_seconds: Annotated[float, Field(ge=0, le=86400, allow_inf_nan=False)] = 0.0


class StateReply(Message):
    """The state, the newest revision ("confirmed empty" makes one), and what counts now."""

    state: ReviewState
    revision: int
    truth: TruthInfo | None


class VerdictChange(Message):
    """A verdict on a region's decision, with a reason (of the list, as a rule) and a comment."""

    verdict: Verdict
    reason: Word = ""
    comment: Comment = ""


class RevisionInfo(Message):
    """One line of a pair's history."""

    number: int
    source: str
    annotator: str | None
    area: int
    active_seconds: float
    created_at: str
    tools: list[str]


class QueueQuery(Message):
    """Filters and order of the queue; `search` are words of "split/name" or of objects' labels."""

    split: Key | None = None
    state: PairState | None = None
    team: TeamState | None = None
    order: QueueOrder = "name"
    search: Word = ""
    run: Key | None = None
    limit: Annotated[int, Field(ge=1, le=5000)] = 100
    offset: Annotated[int, Field(ge=0, le=10_000_000)] = 0
