"""The shipped click net as a click segmenter: change-aware, made for things of 6 to 200 pixels.

A first click is looked at in windows of several sizes, and the best rated masks a second time, in a
window that fits them; what most of the looks agree on is the answer. A later click is looked at in
windows a little narrower and wider than the mask that it corrects needs, and their mean is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
import torch
from torch import nn
from torch.nn.utils.fusion import fuse_conv_bn_eval

from reviewer.masks import Mask, intersection_over_union
from reviewer.models.clicks.windows import (
    Sight,
    Square,
    corrected,
    look,
    placed_back,
    square_around,
)
from reviewer.models.device import check_recorded, fingerprint
from reviewer.models.interfaces import Candidate, Click, Embedding, Field, Image, Prompt
from reviewer.models.nets.click_net import ClickNet
from reviewer.models.nets.small import load_small, small_weights

NAME = "click-net"
FIRST_LOOKS = (36.0, 80.0, 176.0, 384.0)
"""Sides of the windows of a first click, when nothing is known of the thing's size."""
SECOND_LOOKS = 2
NARROWER_AND_WIDER = (0.82, 1.0, 1.3)
MOST_CANDIDATES = 3
ALIKE = 0.93
CUT_OFF = 0.06
"""A first look whose mask reaches so near the border of its window has not seen all of it."""


@dataclass(frozen=True, slots=True)
class _Seen:
    mask: Mask
    score: float


@dataclass(frozen=True)
class NetClicks:
    """Clicks by the small net."""

    net: ClickNet = field(repr=False)
    weights: str

    @classmethod
    def load(cls, path: str = "") -> NetClicks:
        """Read weights, "" = those of the package; raises as `load_small`."""
        net = ClickNet()
        load_small(small_weights(NAME, path), net, NAME)
        found = fingerprint(net)
        for part in (*net.down, *net.up):
            # Batch norms are folded into the convolutions: a fifth of the time.
            part.first = fuse_conv_bn_eval(part.first, part.first_norm)
            part.second = fuse_conv_bn_eval(part.second, part.second_norm)
            part.first_norm = part.second_norm = nn.Identity()
        return cls(net, found)

    def check(self, recorded: str) -> str:
        """Return the fingerprint; raises InvalidInput when a run began with another."""
        return check_recorded(NAME, self.weights, recorded)

    @property
    def model_id(self) -> str:
        """Name and weights."""
        return f"{NAME}:{self.weights}"

    @property
    def keeps_embeddings(self) -> bool:
        """Embedding is a copy: not worth keeping."""
        return False

    def embed(
        self,
        image: Image,
        other: Image | None,
        confidence: Field | None = None,
        change: Field | None = None,
    ) -> Embedding:
        """Keep the pictures and what is known beside; without a reference, confidence is 0."""
        if other is None:
            other = np.zeros_like(image)
            confidence = np.zeros(image.shape[:2], np.float32)
        if confidence is None:
            confidence = np.ones(image.shape[:2], np.float32)
        if change is None:
            change = np.zeros(image.shape[:2], np.float32)
        return {
            "picture": image.astype(np.float32),
            "other": other.astype(np.float32),
            "confidence": confidence,
            "change": change,
        }

    def predict(self, embedding: Embedding, prompt: Prompt) -> list[Candidate]:
        """Return candidates, best first."""
        shape = embedding["confidence"].shape
        clicks, previous = list(prompt.clicks), prompt.previous
        if prompt.box_xyxy is not None and previous is None:
            previous = _ellipse(prompt.box_xyxy, (shape[0], shape[1]))
            if not clicks:
                x0, y0, x1, y1 = prompt.box_xyxy
                clicks = [Click((x0 + x1) / 2, (y0 + y1) / 2)]
        if previous is None or not previous.any():
            found = self._first(embedding, clicks)
        else:
            found = [self._corrected(embedding, previous, clicks)]
        if prompt.box_xyxy is not None:
            found = [_Seen(seen.mask & _box(prompt.box_xyxy, shape), seen.score) for seen in found]
        return _ranked(found, prompt.clicks)

    def _first(self, embedding: Embedding, clicks: Sequence[Click]) -> list[_Seen]:
        newest = next((c for c in reversed(clicks) if c.positive), clicks[-1])
        squares = [Square(newest.x, newest.y, side) for side in FIRST_LOOKS]
        seen = self._look(embedding, [(square, None) for square in squares], clicks)
        whole = [
            _Seen(s.mask, s.score * (0.6 if _is_cut(s.mask, square) else 1.0))
            for s, square in zip(seen, squares, strict=True)
        ]
        best = sorted((s for s in whole if s.mask.any()), key=lambda s: -s.score)[:SECOND_LOOKS]
        again = [(square_around(s.mask, clicks), s.mask) for s in best]
        seen = whole + (self._look(embedding, again, clicks) if again else [])
        return _agreed(seen)

    def _corrected(self, embedding: Embedding, before: Mask, clicks: Sequence[Click]) -> _Seen:
        around = square_around(before, clicks)
        squares = [replace(around, side=around.side * share) for share in NARROWER_AND_WIDER]
        sight = Sight(**embedding)
        probabilities, ratings = self._ask([look(sight, s, clicks, before) for s in squares])
        total, looks = np.zeros(before.shape, np.float32), np.zeros(before.shape, np.float32)
        for square, probability in zip(squares, probabilities, strict=True):
            found, covered = placed_back(probability, square, (before.shape[0], before.shape[1]))
            total += found
            looks += covered
        mask = np.where(looks > 0, total > 0.5 * looks, before)
        return _Seen(mask, float(np.mean(ratings)))

    def _ask(self, windows: Sequence[Field]) -> tuple[Field, list[float]]:
        """Return probabilities (N, 96, 96) and guessed IoUs."""
        with torch.inference_mode():
            logits, rating = self.net(
                torch.from_numpy(np.stack(windows)).to(memory_format=torch.channels_last)
            )
        return torch.sigmoid(logits).numpy(), torch.sigmoid(rating).tolist()

    def _look(
        self, embedding: Embedding, squares: Sequence[tuple[Square, Mask | None]],
        clicks: Sequence[Click],
    ) -> list[_Seen]:  # fmt: skip
        sight = Sight(**embedding)
        probabilities, ratings = self._ask(
            [look(sight, square, clicks, before) for square, before in squares]
        )
        found = []
        for (square, before), probability, rated in zip(
            squares, probabilities, ratings, strict=True
        ):
            nothing = np.zeros(sight.confidence.shape, np.bool_)
            mask = corrected(nothing if before is None else before, probability, square)
            found.append(_Seen(mask, rated))
        return found


def _agreed(seen: Sequence[_Seen]) -> list[_Seen]:
    """Put what the looks agree on first, with the best rating of them all.

    The guessed IoU of one look says little (it correlates weakly with the true one); that several
    windows give the same mask says more.
    """
    looks = [s for s in seen if s.mask.any()]
    if len(looks) < 2:
        return list(seen)
    alike = np.array([[intersection_over_union(a.mask, b.mask) for b in looks] for a in looks])
    weights = ((alike.sum(axis=1) - 1) / (len(looks) - 1)) ** 2
    if not weights.any():
        return list(seen)
    votes = sum(w * s.mask for w, s in zip(weights, looks, strict=True)) / weights.sum()
    agreed = np.asarray(votes > 0.5)
    if not agreed.any():
        agreed = looks[int(weights.argmax())].mask
    return [_Seen(agreed, max(s.score for s in seen)), *seen]


def _is_cut(mask: Mask, square: Square) -> bool:
    x, y, width, height = cv2.boundingRect(mask.view(np.uint8))
    half = square.side * (0.5 - CUT_OFF)
    return bool(
        x < square.x - half
        or y < square.y - half
        or x + width > square.x + half
        or y + height > square.y + half
    )


def _ellipse(box: tuple[float, float, float, float], shape: tuple[int, int]) -> Mask:
    x0, y0, x1, y1 = box
    mask = np.zeros(shape, np.uint8)
    middle = (int((x0 + x1) / 2), int((y0 + y1) / 2))
    axes = (max(1, int((x1 - x0) / 2)), max(1, int((y1 - y0) / 2)))
    cv2.ellipse(mask, middle, axes, 0, 0, 360, 1, -1)
    return mask.view(np.bool_)


def _box(box: tuple[float, float, float, float], shape: Sequence[int]) -> Mask:
    x0, y0, x1, y1 = box
    mask = np.zeros(tuple(shape), np.bool_)
    mask[max(0, int(y0)) : int(np.ceil(y1)), max(0, int(x0)) : int(np.ceil(x1))] = True
    return mask


def _ranked(found: Sequence[_Seen], clicks: Sequence[Click]) -> list[Candidate]:
    """Best first, without near duplicates; clicked pixels are as the clicks say."""
    kept: list[Candidate] = []
    for seen in sorted(found, key=lambda s: -s.score):
        mask = seen.mask.copy()
        for click in clicks:
            y = min(max(int(click.y), 0), mask.shape[0] - 1)
            x = min(max(int(click.x), 0), mask.shape[1] - 1)
            mask[y, x] = click.positive
        if all(intersection_over_union(mask, other.mask) < ALIKE for other in kept):
            kept.append(Candidate(mask, seen.score))
    return kept[:MOST_CANDIDATES]
