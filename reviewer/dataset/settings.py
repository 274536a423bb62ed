"""What a user can choose for the import of a split: layout, masks, poses.

Checked when it is said, before any file is read.
"""

from __future__ import annotations

from dataclasses import dataclass

from reviewer.errors import InvalidInput
from reviewer.words import Heading, Layout, Polarity

Colour = tuple[int, int, int]

OWN_MASKS: tuple[Layout, ...] = ("vl-cmu-cd", "changesim")
"""Layouts whose masks mean what they were published with, and nothing else."""


@dataclass(frozen=True, slots=True)
class ImportSettings:
    """How to read a split.

    Attributes:
        layout: folder layout, see `layouts`.
        polarity: which mask colour is "changed"; "auto" looks at the masks.
        max_distance: largest viewpoint distance of a pair, metres (layout `sequence`).
        metres_per_radian: weight of heading in the viewpoint distance.
        heading: unit of `theta` in poses.csv; "auto" takes radians where no heading is more than
            a turn.
        changed: grey levels of masks that mean changed, in place of a polarity.
        ignore: grey levels of masks that are not to be scored.
        mask_threshold: changed where a mask is lighter than this level, in place of a polarity.
        changed_colour: RGB of changed pixels in masks of colours, in place of a polarity.
        skip_bad: leave out pairs with an unreadable file or of two sizes, instead of refusing.
    """

    layout: Layout = "sequence"
    polarity: Polarity = "auto"
    max_distance: float = 0.5
    metres_per_radian: float = 1.0
    heading: Heading = "auto"
    changed: tuple[int, ...] = ()
    ignore: tuple[int, ...] = ()
    mask_threshold: int | None = None
    changed_colour: Colour | None = None
    skip_bad: bool = False

    def __post_init__(self) -> None:
        for option, levels in (("changed", self.changed), ("ignore", self.ignore)):
            for level in levels:
                if not 0 <= level <= 255:
                    raise InvalidInput(f"--{option} {level}: grey levels go from 0 to 255")
        both = sorted(set(self.changed) & set(self.ignore))
        if both:
            raise InvalidInput(f"--changed {both[0]}: is named by --ignore, too")
        if self.mask_threshold is not None and not 0 <= self.mask_threshold < 255:
            raise InvalidInput(f"--mask-threshold {self.mask_threshold}: goes from 0 to 254")
        told = [
            option
            for option, is_told in (
                (f"polarity {self.polarity}", self.polarity != "auto"),
                ("--changed", bool(self.changed)),
                ("--mask-threshold", self.mask_threshold is not None),
                ("--changed-colour", self.changed_colour is not None),
            )
            if is_told
        ]
        if len(told) > 1:
            raise InvalidInput(f"{told[0]} and {told[1]}: say one of them what changed means")
        if self.ignore and self.changed_colour is not None:
            raise InvalidInput("--ignore and --changed-colour: a mask is of levels or of colours")
        if self.layout in OWN_MASKS and (told or self.ignore):
            option = told[0] if told else "--ignore"
            raise InvalidInput(f"{option}: masks of layout {self.layout} have their own meaning")
