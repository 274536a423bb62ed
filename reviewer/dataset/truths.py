"""Ground truth from mask files: which levels or colours mean changed, which are not scored.

A layout has its own meaning, or the user says one, or all masks are looked at: two levels, of which
the rarer one is changed; the levels of CDnet (255 changed, 85 and 170 not scored, 0 and 50
unchanged); or class numbers with 255 around them as in VOC. A few stray pixels between the known
levels, as editing and resampling leave them, are taken for the nearest of those and counted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from reviewer.dataset.files import read_grey, read_rgb
from reviewer.dataset.settings import Colour, ImportSettings
from reviewer.errors import InvalidInput
from reviewer.masks import Mask

Levels = npt.NDArray[np.uint8]
"""uint8 (H, W), grey levels of a mask file."""

MOST_STRAY = 0.05
"""Share of a mask's pixels that may be stray."""
LEAST_OWN = 0.02
"""Share of the pixels that are not black from which on a level means something of its own."""
CDNET_VOID, CDNET_KEPT = frozenset({85, 170}), frozenset({0, 50})
LARGEST_CLASS = 40
OTHERS = (
    "; say what they mean: --changed LEVEL and --ignore LEVEL, --mask-threshold LEVEL,"
    " --changed-colour RRGGBB, or --polarity nonzero"
)
KEPT, CHANGED, IGNORED = 0, 1, 2


@dataclass(frozen=True, slots=True)
class Truth:
    """What a mask file says.

    Attributes:
        changed: bool (H, W), True = changed.
        ignored: bool (H, W), not to be scored; None when all is.
        stray_px: pixels of a level that means nothing, taken for the nearest that does.
    """

    changed: Mask
    ignored: Mask | None = None
    stray_px: int = 0


@dataclass(frozen=True, slots=True)
class MaskRule:
    """How the masks of a split are read, and a sentence that says it."""

    says: str
    read: Callable[[Path], Truth]


def find_rule(masks: Sequence[Path], settings: ImportSettings) -> MaskRule:
    """Return how to read masks: by the layout, by the user's choice, or by what is in the files.

    Raises:
        InvalidInput: when a mask that has to be looked at cannot be read, and is not to be skipped.
    """
    void, polarity = frozenset(settings.ignore), settings.polarity
    beside = f", {_named(void)} = not scored" if void else ""
    if settings.layout == "changesim":
        return MaskRule("not black = changed (layout changesim)", _not_black)
    if settings.layout == "vl-cmu-cd":
        says = "1 to 254 = changed (255 is sky) (layout vl-cmu-cd)"
        return _by_levels(says, range(1, 255), ())
    if settings.changed_colour is not None:
        colour = settings.changed_colour
        says = f"colour {bytes(colour).hex()} = changed (as told)"
        return MaskRule(says, lambda path: _of_colour(path, colour))
    if settings.changed:
        says = f"{_named(settings.changed)} = changed{beside}, all else unchanged (as told)"
        return _by_levels(says, settings.changed, void)
    if settings.mask_threshold is not None:
        says = f"above {settings.mask_threshold} = changed{beside} (as told)"
        return _by_levels(says, range(settings.mask_threshold + 1, 256), void)
    if polarity == "nonzero" or (settings.layout == "pscd" and polarity == "auto"):
        how = "as told" if polarity == "nonzero" else "layout pscd"
        return _by_levels(f"above 0 = changed{beside} ({how})", range(1, 256), void, clip=True)
    if not masks:
        return MaskRule("no masks", _not_black)
    return _as_they_look(masks, settings, void, beside)


def _as_they_look(
    masks: Sequence[Path], settings: ImportSettings, void: frozenset[int], beside: str
) -> MaskRule:
    counts, solid = _look(masks, void, settings.skip_bad)
    present = set(np.flatnonzero(counts.sum(axis=0)).tolist())
    if settings.polarity == "auto" and not void:
        levels = CDNET_VOID | CDNET_KEPT | {255}
        if 255 in present and _weighty(counts) & CDNET_VOID and solid <= levels:
            says = "255 = changed, 85 and 170 = not scored, 0 and 50 unchanged"
            return _by_levels(f"{says} (guessed: levels of CDnet)", {255}, CDNET_VOID, levels)
        beside_255 = counts[counts[:, 255] > 0]
        found = set(np.flatnonzero(beside_255.sum(axis=0)).tolist()) - {0, 255}
        if max(found, default=255) <= LARGEST_CLASS and _weighty(beside_255) - {255}:
            says = "1 to 254 = changed, 255 = not scored"
            return _by_levels(f"{says} (guessed: class numbers, as in VOC)", range(1, 255), {255})
    # A level that has an area of its own is no stray one.
    forgiving = 255 in present and solid <= {0, 1, 255}
    black = settings.polarity == "black"
    how = "as told"
    if settings.polarity == "auto":
        share = float(np.mean(counts[:, 1:].sum(axis=1) / np.maximum(1, counts.sum(axis=1))))
        black = share > 0.5
        how = f"guessed: {share:.1%} of {len(masks)} masks is not black"
    colour = "black" if black else "white"
    says = f"{colour} = changed{beside} ({how})"
    return MaskRule(says, lambda path: read_two_levels(path, black, void, forgiving=forgiving))


def _look(
    masks: Sequence[Path], void: frozenset[int], skip_bad: bool
) -> tuple[npt.NDArray[np.int64], set[int]]:
    """Return pixels by mask and level, int64 (N, 256), and the levels that fill 3x3 pixels of one;
    without void ones, and without bad masks when they are skipped later."""

    def look(path: Path) -> tuple[npt.NDArray[np.int64], set[int]]:
        try:
            levels = _levels(path)
        except InvalidInput:
            if not skip_bad:
                raise
            return np.zeros(256, np.int64), set()
        counts = np.bincount(levels.ravel(), minlength=256)
        counts[list(void)] = 0
        if not counts[1:255].any():
            return counts, set()
        block = np.ones((3, 3), np.uint8)
        filled = levels[cv2.erode(levels, block) == cv2.dilate(levels, block)]
        return counts, set(np.unique(filled).tolist()) - void

    with ThreadPoolExecutor() as pool:
        found = list(pool.map(look, masks))
    return np.array([counts for counts, _ in found]), set().union(*(solid for _, solid in found))


def _weighty(counts: npt.NDArray[np.int64]) -> set[int]:
    """Return the levels above 0 that are a share of what is not black that cannot be chance."""
    total = counts.sum(axis=0)
    least = max(1.0, LEAST_OWN * float(total[1:].sum()))
    return {int(level) for level in np.flatnonzero(total >= least) if level}


def _levels(path: Path, *, clip: bool = False) -> Levels:
    """Return the levels of a grey mask file.

    Args:
        clip: levels above 255 count as 255.

    Raises:
        InvalidInput: when it is no readable grey image of 8 bits, nor one of 0 and another value.
    """
    array: npt.NDArray[Any] = read_grey(
        path, hint=" (--changed-colour RRGGBB says which one means changed)"
    )
    if array.dtype == np.uint8:
        return np.asarray(array, np.uint8)
    if array.dtype == np.bool_:
        return np.where(array, np.uint8(255), np.uint8(0))
    most = array.max()
    if array.dtype.kind not in "iu" or array.min() < 0:
        raise InvalidInput(f"{path}: a mask holds whole numbers from 0, not {array.dtype}")
    if most <= 255:
        return array.astype(np.uint8)
    if not clip and ((array != 0) & (array != most)).any():
        raise InvalidInput(
            f"{path}: a mask holds 0 and one other value, but this one has levels up to {most}"
            f"{OTHERS}"
        )
    return np.asarray(np.minimum(array, 255), np.uint8)


def read_two_levels(
    path: Path, black: bool = False, void: frozenset[int] = frozenset(), *, forgiving: bool = False
) -> Truth:
    """Return how to read masks of 0 and one other level.

    Args:
        black: black is changed, and not the other one.
        void: levels that are not to be scored.
        forgiving: beside 0 and 255 (or 0 and 1), a few others are taken for the nearer one.

    Raises:
        InvalidInput: when it holds more levels than that.
    """
    levels = _levels(path)
    ignored = _table(void, IGNORED)[levels] == IGNORED if void else None
    rest = levels if ignored is None else np.where(ignored, np.uint8(0), levels)
    light, top = rest != 0, int(rest.max())
    exact = (rest[light] == top).all() and (not forgiving or top in (0, 1, 255))
    stray_px = 0 if exact else int(np.count_nonzero(light & (rest != 255)))
    if not exact:
        if not forgiving or stray_px > MOST_STRAY * levels.size:
            _refuse(path, levels)
        light = rest > 127
    changed: Mask = ~light if black else light
    if ignored is None:
        return Truth(changed, None, stray_px)
    return Truth(changed & ~ignored, ignored if ignored.any() else None, stray_px)


def _refuse(path: Path, levels: Levels) -> None:
    values = np.unique(levels)
    raise InvalidInput(
        f"{path}: a mask holds 0 and one other value, but this one has {len(values)} values from"
        f" {values[0]} to {values[-1]}{OTHERS}"
    )


def _by_levels(
    says: str,
    changed: Sequence[int] | set[int] | range,
    void: Sequence[int] | frozenset[int] | set[int],
    known: frozenset[int] | None = None,
    *,
    clip: bool = False,
) -> MaskRule:
    """Return a rule of levels; all mean something, or those that are `known` do."""
    meaning = _table(changed, CHANGED)
    meaning[list(void)] = IGNORED
    every = np.arange(256)
    places = np.array(sorted(known)) if known else every
    stray = ~np.isin(every, places)
    if known:
        meaning = meaning[places[np.abs(every[:, None] - places).argmin(axis=1)]]

    def read(path: Path) -> Truth:
        levels = _levels(path, clip=clip)
        stray_px = int(np.count_nonzero(stray[levels])) if known else 0
        if stray_px > MOST_STRAY * levels.size:
            _refuse(path, levels)
        means = meaning[levels]
        ignored: Mask = means == IGNORED
        return Truth(means == CHANGED, ignored if ignored.any() else None, stray_px)

    return MaskRule(says, read)


def _table(levels: Sequence[int] | frozenset[int] | set[int] | range, meaning: int) -> Levels:
    table = np.full(256, KEPT, np.uint8)
    table[list(levels)] = meaning
    return table


def _not_black(path: Path) -> Truth:
    return Truth(np.asarray(read_rgb(path).any(axis=2)))


def _of_colour(path: Path, colour: Colour) -> Truth:
    return Truth(np.asarray((read_rgb(path) == np.array(colour, np.uint8)).all(axis=2)))


def _named(levels: Sequence[int] | frozenset[int]) -> str:
    first, last = [str(level) for level in sorted(levels)[:-1]], str(max(levels))
    return f"{', '.join(first)} and {last}" if first else last
