"""The same search on both images: live as it is, the reference warped or as it was taken."""

from __future__ import annotations

from collections.abc import Callable

from reviewer.errors import InvalidInput
from reviewer.models.interfaces import Image, Instance, Objects, PairView
from reviewer.models.warping import warp_mask
from reviewer.words import REFERENCE_FRAMES, ReferenceFrame

Find = Callable[[Image], list[Instance]]


def check_frame(frame: str) -> None:
    """Raises InvalidInput unless the frame is "warped" or "raw"."""
    if frame not in REFERENCE_FRAMES:
        raise InvalidInput(f"segmenter setting reference: must be warped or raw, not {frame!r}")


def find_on_both(view: PairView, find: Find, frame: ReferenceFrame) -> Objects:
    """Return what `find` finds on both images, in the live frame.

    Args:
        frame: "warped" searches the reference warped to live; "raw" searches it as it was taken
            and warps the masks, nearest neighbour. Reference masks end where the warp does.
    """
    live = [thing for thing in find(view.live) if thing.mask.any()]
    past = []
    for thing in find(view.warped if frame == "warped" else view.reference):
        mask = thing.mask if frame == "warped" else warp_mask(thing.mask, view.flow)
        mask = mask & view.valid
        if mask.any():
            past.append(Instance(mask, thing.label, thing.score))
    return Objects(tuple(live), tuple(past))
