"""Click segmenter without weights: GrabCut on colour and on the change against the other image.

An object that appeared differs from the aligned reference where it lies, so the difference is as
good a cue as its colour. Both are projected to the three channels that OpenCV's GrabCut takes: two
principal components of colour and one of change, inside a window around the click. The size of the
object is not known at the first click, so windows of several sizes are tried, and rated by how
sharp the mask's rim is and how much more has changed inside than around it. Later clicks cut again
under all clicks so far, and near the newest one only, whichever is rated better.
Deterministic: the random seed of the colour models is fixed.

Source: Rother et al., GrabCut (SIGGRAPH 2004); the change cue and the rating are our own.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from reviewer.masks import Mask, dilate, fill_holes, intersection_over_union, keep_touched
from reviewer.models.clicks.scene import (
    Scene,
    box_of,
    change_between,
    disc,
    levels_of_change,
    placed,
    to_lab,
)
from reviewer.models.interfaces import Candidate, Click, Embedding, Field, Image, Prompt

Labels = npt.NDArray[np.uint8]

RADII = (4, 8, 16, 32, 64)
MOST_CANDIDATES = 4
REACHES = (1.5, 3.0, 6.0)
LARGEST_REACH = 60
CHROMA_WEIGHT = 1.5
# What a broken click, a mask like the one before, and a newest click without effect count.
BROKEN_CLICK, LOYALTY, UNHEARD = 0.3, 0.05, 0.6


@dataclass(frozen=True, slots=True)
class GrabCutClicks:
    """GrabCut around the click.

    Attributes:
        change_weight: weight of the difference to the other image beside colour.
        iterations: of GrabCut.
        side_px: windows are scaled down to this for the first cut.
    """

    change_weight: float = 0.6
    iterations: int = 3
    side_px: int = 90

    @property
    def model_id(self) -> str:
        """There is one model, the same on every machine."""
        return "grabcut"

    @property
    def keeps_embeddings(self) -> bool:
        """Embedding is quicker than reading from disk."""
        return False

    def embed(
        self,
        image: Image,
        other: Image | None,
        confidence: Field | None = None,
        change: Field | None = None,
    ) -> Embedding:
        """Return `features` (H, W, 6), weighted CIELAB and its change, and `change` (H, W).

        Neither the confidence nor a detector is asked.
        """
        del confidence, change
        colour = to_lab(image)
        differs = np.zeros_like(colour) if other is None else change_between(colour, to_lab(other))
        strength = np.linalg.norm(differs, axis=2)
        weights = np.asarray([1, CHROMA_WEIGHT, CHROMA_WEIGHT], np.float32)
        features = np.concatenate(
            [colour * weights, differs * weights * self.change_weight], axis=2
        )
        return {"features": features.astype(np.float32), "change": strength.astype(np.float32)}

    def predict(self, embedding: Embedding, prompt: Prompt) -> list[Candidate]:
        """Return candidates, best first; all of them respect the clicks."""
        scene = Scene(embedding["features"], embedding["change"])
        clicks, before = prompt.clicks, prompt.previous
        masks: list[Mask] = []
        if prompt.box_xyxy is not None:
            masks.append(self._boxed(scene, prompt.box_xyxy))
        positive = [click for click in clicks if click.positive]
        if positive:
            masks += self._anew(scene, positive[0], clicks)
        if clicks and before is not None and before.any():
            masks += self._corrected(scene, clicks, before)
            if clicks[-1].positive and clicks[-1] is not positive[0]:
                masks += [before | part for part in self._beside(scene, clicks, before)]
        return _ranked([_candidate(scene, mask, prompt) for mask in masks])

    def _anew(self, scene: Scene, click: Click, clicks: Sequence[Click]) -> Iterable[Mask]:
        """Yield a mask for every size the object may have, and for every level of change."""
        x, y = scene.pixel(click)
        for radius in _sizes(click, clicks):
            window = scene.window(x, y, radius)
            near = disc(window, x, y, radius)
            seed = disc(window, x, y, max(1.0, 0.3 * radius))
            features = scene.features[window]
            distance = np.linalg.norm(features - features[seed].mean(axis=0), axis=2)
            alike = near & (distance <= np.percentile(distance[near], 70))
            prior = placed(scene, window, alike | seed)
            yield self._cut(scene, x, y, int(2.2 * radius) + 3, prior, clicks)
        for mask in levels_of_change(scene, x, y):
            x0, y0, x1, y1 = box_of(mask)
            reach = max(x - x0, x1 - x, y - y0, y1 - y)
            yield self._cut(scene, x, y, int(1.5 * reach) + 6, mask, clicks)

    def _beside(self, scene: Scene, clicks: Sequence[Click], before: Mask) -> Iterable[Mask]:
        """Yield the parts that the newest click may add, at the size of its gap to the rest."""
        x, y = scene.pixel(clicks[-1])
        reach = int(2 * scene.gap(before, x, y)) + 3
        window = scene.window(x, y, reach)
        prior = placed(scene, window, disc(window, x, y, reach / 2))
        yield self._cut(scene, x, y, reach, prior, clicks)

    def _cut(
        self, scene: Scene, x: int, y: int, reach: int, prior: Mask, clicks: Sequence[Click]
    ) -> Mask:
        """Cut a window of `reach` around a pixel that belongs to the object; coarse, then fine."""
        window = scene.window(x, y, reach)
        features, inside = scene.features[window], prior[window]
        step = -(-max(inside.shape) // self.side_px)
        small = _shrunk(features, step)
        height, width = small.shape[:2]
        top, left = window[0].start, window[1].start
        cy, cx = min((y - top) // step, height - 1), min((x - left) // step, width - 1)
        labels = np.where(_resized(inside, width, height), cv2.GC_PR_FGD, cv2.GC_PR_BGD)
        rows, columns = np.ogrid[:height, :width]
        labels[(rows - cy) ** 2 + (columns - cx) ** 2 > (reach / step) ** 2] = cv2.GC_BGD
        labels[[0, -1]] = cv2.GC_BGD
        labels[:, [0, -1]] = cv2.GC_BGD
        seeds = []
        for click in clicks:
            u, v = (
                (c - start) // step
                for c, start in zip(scene.pixel(click), (left, top), strict=True)
            )
            if 0 <= u < width and 0 <= v < height:
                labels[v, u] = cv2.GC_FGD if click.positive else cv2.GC_BGD
                seeds += [(u, v)] if click.positive else []
        labels[cy, cx] = cv2.GC_FGD
        found = keep_touched(self._grab(small, labels.astype(np.uint8)), [*seeds, (cx, cy)])
        if all(click.positive for click in clicks):
            found = fill_holes(found)
        if step > 1:
            found = self._sharpen(features, _resized(found, inside.shape[1], inside.shape[0]), step)
        return placed(scene, window, found)

    def _sharpen(self, features: Field, rough: Mask, step: int) -> Mask:
        """Cut again at full resolution, in the band where the coarse cut may be wrong."""
        size = 2 * step + 1
        inner = ~dilate(~rough, size_px=size)
        band = dilate(rough, size_px=size) & ~inner
        if not band.any():
            return rough
        labels = np.where(rough, cv2.GC_FGD, cv2.GC_BGD).astype(np.uint8)
        labels[band & rough], labels[band & ~rough] = cv2.GC_PR_FGD, cv2.GC_PR_BGD
        x0, y0, x1, y1 = box_of(band)
        part = np.s_[max(0, y0 - 2) : y1 + 2, max(0, x0 - 2) : x1 + 2]
        result = rough.copy()
        result[part] = self._grab(features[part], labels[part].copy(), iterations=1)
        return result

    def _corrected(self, scene: Scene, clicks: Sequence[Click], before: Mask) -> Iterable[Mask]:
        """Yield masks that differ from the one before only around the newest click."""
        newest = clicks[-1]
        x, y = scene.pixel(newest)
        gap = scene.gap(before, x, y)
        for factor in REACHES:
            reach = min(int(factor * gap) + 4, LARGEST_REACH)
            window = scene.window(x, y, reach)
            held = before[window]
            labels = np.where(held, cv2.GC_PR_FGD, cv2.GC_PR_BGD).astype(np.uint8)
            far = ~disc(window, x, y, reach)
            labels[far & held], labels[far & ~held] = cv2.GC_FGD, cv2.GC_BGD
            for click in clicks:
                size = max(1.0, 0.5 * gap) if click is newest else 0.5
                sure = cv2.GC_FGD if click.positive else cv2.GC_BGD
                labels[disc(window, *scene.pixel(click), size)] = sure
            result = before.copy()
            result[window] = self._grab(scene.features[window], labels)
            yield result
        # Whatever the colours say, the click itself is followed.
        window = scene.window(x, y, int(gap) + 2)
        drawn = before.copy()
        drawn[window][disc(window, x, y, max(1.0, gap))] = newest.positive
        yield drawn

    def _boxed(self, scene: Scene, box: tuple[float, float, float, float]) -> Mask:
        """Cut what is inside a box from what is around it."""
        height, width = scene.change.shape
        x0, y0 = max(0, int(box[0])), max(0, int(box[1]))
        x1, y1 = min(width, int(np.ceil(box[2]))), min(height, int(np.ceil(box[3])))
        margin = max(6, (x1 - x0) // 3, (y1 - y0) // 3)
        window = np.s_[max(0, y0 - margin) : y1 + margin, max(0, x0 - margin) : x1 + margin]
        inside = np.zeros(scene.change.shape, np.bool_)
        inside[y0:y1, x0:x1] = True
        features = scene.features[window]
        step = -(-max(features.shape[:2]) // (2 * self.side_px))
        small = _shrunk(features, step)
        held = _resized(inside[window], small.shape[1], small.shape[0])
        labels = np.where(held, cv2.GC_PR_FGD, cv2.GC_BGD).astype(np.uint8)
        found = self._grab(small, labels)
        if step > 1:
            rows, columns = features.shape[:2]
            found = self._sharpen(features, _resized(found, columns, rows), step)
        return placed(scene, window, fill_holes(found)) & inside

    def _grab(self, features: Field, labels: Labels, iterations: int | None = None) -> Mask:
        sides = (labels == cv2.GC_FGD) | (labels == cv2.GC_PR_FGD)
        count = int(np.count_nonzero(sides))
        # Each side needs a pixel for each of the five colours of its model.
        if not 5 <= count <= sides.size - 5:
            return np.asarray(sides)
        cv2.setRNGSeed(0)
        models = np.zeros((1, 65)), np.zeros((1, 65))
        rounds = self.iterations if iterations is None else iterations
        picture = _projected(features)
        cv2.grabCut(picture, labels, None, *models, rounds, cv2.GC_INIT_WITH_MASK)
        return np.asarray((labels == cv2.GC_FGD) | (labels == cv2.GC_PR_FGD))


def _projected(features: Field) -> Image:
    """Return the two strongest components of colour and the strongest of change, 8-bit, one scale.

    Change has a channel of its own: texture would crowd it out of the strongest three of all.
    """
    colour, change = _strongest(features[..., :3], 2), _strongest(features[..., 3:], 1)
    channels = np.concatenate([colour, change], axis=2)
    reach = max(20.0, float(np.percentile(np.abs(channels), 99.5)))
    return np.clip(channels * (127 / reach) + 128, 0, 255).astype(np.uint8)


def _strongest(features: Field, count: int) -> Field:
    """Project on the principal axes."""
    flat = features.reshape(-1, features.shape[2])
    centred = flat - flat.mean(axis=0)
    _, axes = np.linalg.eigh(centred.T @ centred)
    return np.asarray((centred @ axes[:, ::-1][:, :count]).reshape(*features.shape[:2], count))


def _sizes(click: Click, clicks: Sequence[Click]) -> list[int]:
    """Return the radii that the other clicks leave possible for the object under a click."""
    least, most = 0.0, float("inf")
    for other in clicks:
        distance = float(np.hypot(other.x - click.x, other.y - click.y))
        if other.positive:
            least = max(least, distance / 2)
        else:
            most = min(most, 2 * distance)
    possible = [radius for radius in RADII if least <= radius <= most]
    return possible or [min(RADII, key=lambda radius: abs(radius - max(least, 1.0)))]


def _shrunk(features: Field, step: int) -> Field:
    if step == 1:
        return features
    size = (max(1, features.shape[1] // step), max(1, features.shape[0] // step))
    halves = (np.ascontiguousarray(features[..., :3]), np.ascontiguousarray(features[..., 3:]))
    small = [cv2.resize(half, size, interpolation=cv2.INTER_AREA) for half in halves]
    return np.concatenate(small, axis=2)


def _resized(mask: Mask, width: int, height: int) -> Mask:
    if mask.shape == (height, width):
        return mask
    pixels = cv2.resize(mask.view(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST)
    return np.asarray(pixels, np.uint8).view(np.bool_)


def _candidate(scene: Scene, mask: Mask, prompt: Prompt) -> Candidate:
    """Set the clicked pixels as the clicks say, and rate the result."""
    obeying = mask.copy()
    broken = 0
    for click in prompt.clicks:
        x, y = scene.pixel(click)
        broken += bool(mask[y, x]) != click.positive
        obeying[y, x] = click.positive
    score = scene.rate(obeying) - BROKEN_CLICK * broken
    if prompt.previous is not None and prompt.clicks:
        newest = prompt.clicks[-1]
        x, y = scene.pixel(newest)
        reach = 0.5 * scene.gap(prompt.previous, x, y)
        window = scene.window(x, y, int(reach) + 1)
        around = obeying[window][disc(window, x, y, max(1.0, reach))]
        score -= UNHEARD * float(np.mean(around != newest.positive))
        score += LOYALTY * intersection_over_union(obeying, prompt.previous)
    return Candidate(obeying, min(max(score, 0.0), 1.0))


def _ranked(candidates: list[Candidate]) -> list[Candidate]:
    """Best first, without near duplicates of better ones."""
    kept: list[Candidate] = []
    for candidate in sorted(candidates, key=lambda c: -c.score):
        if all(intersection_over_union(candidate.mask, other.mask) < 0.93 for other in kept):
            kept.append(candidate)
    return kept[:MOST_CANDIDATES]
