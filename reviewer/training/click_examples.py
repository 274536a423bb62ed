"""Simulated annotators: where they click first, what mask they correct, where they click next.

After RITM (Sofiiuk et al., 2022) and FocalClick (Chen et al., 2022): the next click lies deep in
the largest error, positive ones deep in the thing; masks to correct are the net's own of the step
before, or the truth dilated, eroded, shifted, with a part dropped or a blob added.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import cv2
import numpy as np

from reviewer.masks import Mask, depth, dilate, intersection_over_union
from reviewer.models.clicks.net_clicks import FIRST_LOOKS
from reviewer.models.clicks.windows import Sight, Square, corrected, look, square_around
from reviewer.models.interfaces import Click, Field
from reviewer.models.nets.click_net import SIDE
from reviewer.training.aligned_views import AlignedViews

LEAST_PX = 12
MOST_CLICKS = 8
GOOD_ENOUGH = 0.96
ALONE = 0.2
"""Share of things that are clicked with nothing to compare."""
ANY_WINDOW = 0.35
"""Share of first looks at any scale: a rating is learnt from bad windows as well."""
LOOSE_SHARE, LOOSE_LEAST_PX = 0.35, 400
"""People draw outlines tighter or looser than the edge; the clicks show how."""


@dataclass(slots=True)
class Episode:
    """One thing under clicks.

    Attributes:
        truth: bool (H, W). mask: the mask so far. square: of the next look.
    """

    sight: Sight
    truth: Mask
    mask: Mask
    square: Square
    clicks: list[Click] = field(default_factory=list)

    def window(self) -> Field:
        """Return the net's input."""
        previous = self.mask if self.mask.any() else None
        return look(self.sight, self.square, self.clicks, previous)

    def target(self) -> tuple[Field, Field]:
        """Return the truth in the window and where it counts, float32 (96, 96)."""
        step = int(self.square.side / SIDE)
        truth = self.truth.astype(np.float32)
        if step >= 2:
            truth = cv2.blur(truth, (step, step)).astype(np.float32)
        return self._cut(truth), self._cut(np.ones_like(truth))

    def _cut(self, values: Field) -> Field:
        cut = cv2.warpAffine(values, self.square.matrix(), (SIDE, SIDE))
        return np.asarray(cut, np.float32)

    def follow(self, probability: Field, rng: np.random.Generator) -> bool:
        """Take the net's mask and click again; False when the thing is done."""
        self.mask = corrected(self.mask, probability, self.square)
        done = intersection_over_union(self.mask, self.truth) > GOOD_ENOUGH
        if done or len(self.clicks) >= MOST_CLICKS:
            return False
        click = next_click(self.mask, self.truth, rng)
        if click is None:
            return False
        self.clicks.append(click)
        self.square = _jittered(square_around(self.mask, self.clicks), rng)
        return True


def begin(views: AlignedViews, change: Field, rng: np.random.Generator) -> Iterator[Episode]:
    """Yield an episode for every thing that a person may point at: what changed, and some other.

    Args:
        change: what a detector says of the views, as in `Sight`.
    """
    things = [(m, True) for m in views.came] + [(m, False) for m in views.went]
    standing = [(m, bool(rng.random() < 0.8)) for m in views.standing]
    some = [standing[k] for k in rng.permutation(len(standing))[: max(1, len(things) // 2)]]
    for mask, in_live in things + some:
        truth = _drawn(_largest(mask), rng)
        if np.count_nonzero(truth) < LEAST_PX:
            continue
        pictures = (views.live, views.warped) if in_live else (views.warped, views.live)
        alone = rng.random() < ALONE
        known = (views.confidence, change)
        sight = Sight(*pictures, *(np.zeros_like(k) if alone else k for k in known))
        if rng.random() < 0.3:
            rough = corrupted(truth, rng)
            click = next_click(rough, truth, rng)
            if click is None:
                continue
            square = _jittered(square_around(rough, [click]), rng)
            yield Episode(sight, truth, rough, square, [click])
            continue
        click = first_click(truth, rng)
        _, _, width, height = cv2.boundingRect(truth.view(np.uint8))
        longest = max(width, height)
        fits = [side for side in FIRST_LOOKS if side > 1.1 * longest] or [FIRST_LOOKS[-1]]
        # The tightest fit is the most useful one, the next ones teach the rating.
        side = fits[min(int(rng.geometric(0.6)) - 1, len(fits) - 1)]
        if rng.random() < ANY_WINDOW:
            side = FIRST_LOOKS[int(rng.integers(len(FIRST_LOOKS)))]
        square = Square(click.x, click.y, side * float(np.exp(rng.normal(0, 0.1))))
        empty = np.zeros_like(truth)
        yield Episode(sight, truth, empty, square, [click])


def _drawn(truth: Mask, rng: np.random.Generator) -> Mask:
    """Return a thing's mask as this annotator draws it: on the edge, or a little off."""
    if np.count_nonzero(truth) < LOOSE_LEAST_PX or rng.random() >= LOOSE_SHARE:
        return truth
    size = int(rng.choice([3, 3, 5]))
    if rng.random() < 0.7:
        return dilate(truth, size_px=size)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    return np.asarray(cv2.erode(truth.view(np.uint8), kernel)).view(np.bool_)


def first_click(truth: Mask, rng: np.random.Generator) -> Click:
    """Return a click inside a thing, mostly well inside."""
    deep = depth(truth)
    least = deep.max() * (0.8 if rng.random() < 0.5 else 0.3)
    return _any(deep >= least, True, rng)


def next_click(mask: Mask, truth: Mask, rng: np.random.Generator) -> Click | None:
    """Return a click in the larger error's largest part, deep inside; None without an error."""
    missed, extra = _largest(truth & ~mask), _largest(mask & ~truth)
    if not (missed.any() or extra.any()):
        return None
    positive = np.count_nonzero(missed) >= np.count_nonzero(extra)
    deep = depth(missed if positive else extra)
    return _any(deep >= 0.7 * deep.max(), bool(positive), rng)


def corrupted(truth: Mask, rng: np.random.Generator) -> Mask:
    """Return a mask as a detector or an impatient person leaves it."""
    x, y, width, height = cv2.boundingRect(truth.view(np.uint8))
    longest = max(width, height)
    mask = truth.copy()
    for kind in rng.choice(5, size=int(rng.integers(1, 3)), replace=False):
        size = max(3, round(longest * float(rng.uniform(0.05, 0.3)))) | 1
        if kind == 0:
            mask = dilate(mask, size_px=size)
        elif kind == 1:
            kernel = np.ones((size, size), np.uint8)
            mask = cv2.erode(mask.view(np.uint8), kernel).view(np.bool_)
        elif kind == 2:
            dx, dy = rng.normal(0, 0.12 * longest, 2)
            by = np.array([[1, 0, dx], [0, 1, dy]], np.float32)
            moved = cv2.warpAffine(mask.view(np.uint8), by, mask.shape[::-1])
            mask = moved.view(np.bool_)
        else:
            middle = (
                int(x + width * rng.uniform(-0.1, 1.1)), int(y + height * rng.uniform(-0.1, 1.1))
            )  # fmt: skip
            axes = tuple(int(max(1, longest * rng.uniform(0.1, 0.45))) for _ in range(2))
            levels = mask.astype(np.uint8)
            cv2.ellipse(
                levels, middle, axes, float(rng.uniform(0, 180)), 0, 360, int(kind == 4), -1
            )
            mask = levels.view(np.bool_)
    return mask


def _jittered(square: Square, rng: np.random.Generator) -> Square:
    dx, dy, zoom = rng.normal(0, 1, 3) * (0.03 * square.side, 0.03 * square.side, 0.12)
    return Square(square.x + float(dx), square.y + float(dy), square.side * float(np.exp(zoom)))


def _largest(mask: Mask) -> Mask:
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8))
    if count < 3:
        return mask
    return np.asarray(labels == 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA])))


def _any(choice: Mask, positive: bool, rng: np.random.Generator) -> Click:
    rows, columns = np.nonzero(choice)
    k = int(rng.integers(len(rows)))
    return Click(float(columns[k]) + 0.5, float(rows[k]) + 0.5, positive)
