"""The words that stand for one of a few things, each list once.

What people write on the command line, what the store keeps and what messages carry are the same
words: whoever offers or checks them takes them from here. No import but typing, so that `--help`
stays light. A word that stands for a builder or a text is looked up in a dict where that is; tests
hold that its keys are these words (`tests/test_words.py`).
"""

from __future__ import annotations

from typing import Literal, get_args

# A pair, its masks, and people.
Side = Literal["live", "reference"]
SIDES: tuple[Side, Side] = ("live", "reference")
ReviewState = Literal["todo", "in_progress", "submitted", "approved", "confirmed_empty"]
REVIEW_STATES: tuple[ReviewState, ...] = get_args(ReviewState)
PairState = Literal[ReviewState, "skipped"]
"""The state of a pair as lists show it: that of a person's review, unless it is skipped."""
TeamState = Literal["todo", "in_progress", "waiting", "approved", "changed"]
"""Where a pair stands for the team; "changed" = there is a newer revision than the approved one."""
Standing = Literal["approved", "submitted", "confirmed_empty", "imported"]
"""By what a mask counts as ground truth."""
STANDINGS: tuple[Standing, ...] = get_args(Standing)
FINISHED: frozenset[str] = frozenset({"submitted", "approved", "confirmed_empty"})
"""States in which a pair is locked against slips."""
RevisionSource = Literal["import", "edit", "confirmed_empty", "api"]
ProposalSource = Literal[
    "region",
    "detector",
    "object_live",
    "object_reference",
    "candidate",
    "prediction",
    "missed",
    "extra",
]
PairLayer = Literal[
    "reference",
    "warped",
    "live",
    "difference",
    "unseen",
    "detector",
    "objects_live",
    "objects_reference",
    "doi",
    "prediction",
    "ground_truth",
]
"""What of a pair is shown as a picture."""
QueueOrder = Literal["name", "doi", "size", "unreviewed", "doubt"]

# The equation, decisions, and audits.
Scope = Literal["component", "image"]
SCOPES: tuple[Scope, ...] = get_args(Scope)
Overlaps = Literal["best", "all"]
Seen = Literal["keep", "reject"]
SEEN: tuple[Seen, ...] = get_args(Seen)
Choice = Literal["adopt", "keep", "reject"]
CHOICES: tuple[Choice, ...] = get_args(Choice)
Verdict = Literal["agree", "adopt", "keep", "reject"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
Reason = Literal[
    "between_thresholds",  # low < DoI < high: the object replaces the detector's components
    "seen_in_reference",  # f_b = 0: the object was there before (kept, or rejected by `seen`)
    "agrees",  # DoI <= low although f_b = 1: detector and object are the same mask
    "too_ill_posed",  # DoI >= high: look again
    "no_detection",  # M_o is empty: the output is empty
    "no_object",  # O_l is empty: DoI = 1, M_o is kept
    "outside_warp",  # unseen: no pixel of the object (or of the components alone) can be compared
    "better_object",  # adoptable, but another object fits the shared component better
]
WalkOrder = Literal["threshold", "loss", "disagreement"]
Opinion = Literal["first", "second"]
Vary = Literal["high", "low", "max-overlap-px"]
"""What `whatif` changes."""

# The pipeline.
MemberStage = Literal["align", "detect", "label", "search"]
MEMBER_STAGES: tuple[MemberStage, ...] = get_args(MemberStage)
Stage = Literal[MemberStage, "integrate"]
STAGES: tuple[Stage, ...] = get_args(Stage)
StageOrAll = Literal[Stage, "all"]
EngineName = Literal["local", "ray"]
Reads = Literal["change", "labels"]
"""What a segmenter reads beside the pictures."""
ReferenceFrame = Literal["warped", "raw"]
"""The reference warped to the live image, or as it is."""
REFERENCE_FRAMES: tuple[ReferenceFrame, ...] = get_args(ReferenceFrame)

# Data sets.
Layout = Literal["sequence", "t0t1", "vl-cmu-cd", "pscd", "changesim"]
Polarity = Literal["auto", "white", "black", "nonzero"]
Heading = Literal["auto", "radians", "degrees"]
LayerKind = Literal["alignment", "detection", "live-objects", "reference-objects"]
AnnotationTool = Literal["coco", "labelme", "cvat", "label-studio"]
ExportFormat = Literal[
    "png",
    "coco",
    "coco-panoptic",
    "t0t1",
    "folds",
    "labelme",
    "cvat",
    "yolo-seg",
    "huggingface",
    "webdataset",
]
EXPORT_FORMATS: tuple[ExportFormat, ...] = get_args(ExportFormat)
IgnoreMode = Literal["separate", "255", "none"]
FoldKind = Literal["same-split", "split", "workspace"]

# Nets and training.
TrainedNet = Literal["cscdnet", "cscdnet-attention", "dr-tanet", "cdnet", "tanet"]
"""Nets that are trained here; the others are known by their public checkpoints alone."""
SmallNet = Literal["clicks", "change"]
"""Nets whose weights lie in the package, and that are trained anew here."""
Trainable = Literal[TrainedNet, SmallNet]
NetName = Literal[TrainedNet, "c3po", "rscd-dinov2", "rscd-resnet18"]
NET_NAMES: tuple[NetName, ...] = get_args(NetName)
Preprocessing = Literal["bgr_128", "imagenet", "unit"]
PREPROCESSINGS: tuple[Preprocessing, ...] = get_args(Preprocessing)
BatchNormMode = Literal["eval", "batch"]
BATCH_NORM_MODES: tuple[BatchNormMode, ...] = get_args(BatchNormMode)
Relu = Literal["block", "stage"]
"""After which sums of the encoders a ReLU stands; see `TaNet`."""
RELUS: tuple[Relu, ...] = get_args(Relu)
Merging = Literal["iade", "id"]
"""Which differences of two pictures are merged; see `C3po`."""
MERGINGS: tuple[Merging, ...] = get_args(Merging)
Precision = Literal["auto", "float32", "bfloat16"]
SamFamily = Literal["sam", "sam2"]
Cut = Literal["entropy", "mad"]
"""How a pair's distances are split into changed and not; see `Dinov2Detector`."""
CUTS: tuple[Cut, ...] = get_args(Cut)
PdcNetwork = Literal["PDCNet", "PDCNet_plus"]
RecipeName = Literal["default", "paper"]
TrainedOn = Literal["same_split", "same_workspace", "others"]

# Scores, tables and findings.
Method = Literal["base", "doi", "audited"]
METHODS: tuple[Method, Method, Method] = ("base", "doi", "audited")
PredictionKind = Literal[Method, "final"]
ProtocolKind = Literal["pooled", "image_mean", "mean_pr"]
EmptyRule = Literal["skip", "one", "zero"]
LineWeight = Literal["groups", "images"]
LineGroup = Literal["split", "workspace", "group"]
TextFormat = Literal["json", "csv", "markdown", "latex"]
TableFormat = Literal["table", TextFormat]
FoundFormat = Literal["table", "csv", "html"]
ScoreTable = Literal["table_a", "matrix"]
Finding = Literal["good", "note", "bad"]
