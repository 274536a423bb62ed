"""Weight-free segmenter: object-sized segments near the detector's change mask.

It stands where SAM stands in the paper: given a rough change mask it delivers object masks with
exact borders, and tells whether the same object is in the reference. Superpixels are Felzenszwalb's
(scikit-image); the idea of voting them with a rough mask is common practice. Segments follow every
edge and leave out what the detector left out, so the vote only starts GrabCut (Rother et al.,
SIGGRAPH 2004, as in OpenCV): object against surroundings by colour, near the first guess.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from skimage.segmentation import felzenszwalb

from reviewer.masks import Crop, Mask, components, dilate, intersection_over_union
from reviewer.models.interfaces import Field, Image, Instance, Objects, PairView

Labels = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class OversegmentSegmenter:
    """Snap every changed component to the segments it covers, on both images, and cut it out live.

    Attributes:
        scale, sigma, least_px: Felzenszwalb's parameters.
        margin_px: how far around a component is segmented.
        join_px: components closer than this are one object.
        vote: share of a segment that must lie in the change mask to belong to the object.
        reach_px: how far the cut may move a border, and bridge what the detector left out.
        iterations: of GrabCut.
        present: how alike the contrast of an object must be in the reference to count as there.
    """

    scale: float = 30.0
    sigma: float = 0.6
    least_px: int = 10
    margin_px: int = 32
    join_px: int = 5
    vote: float = 0.5
    reach_px: int = 6
    iterations: int = 2
    present: float = 0.6

    def segment(self, view: PairView) -> Objects:
        """Return one live instance per joined component, and the reference's instances there."""
        warped, live, change, valid = view.warped, view.live, view.change, view.valid
        found_live, found_past = [], []
        _, groups = components(dilate(change, size_px=self.join_px))
        for group in groups:
            window = self._window(group, change.shape)
            rough = change[window] & _inside(group, window)
            if int(np.count_nonzero(rough)) < self.least_px:
                continue
            present, past = live[window], warped[window]
            guess = self._snap(present, rough)
            if guess is None:
                continue
            thing = self._cut(present, guess, rough)
            mask = _placed(thing, window, change.shape)
            score = intersection_over_union(thing, rough)
            found_live.append(Instance(mask, "", score))
            likeness = _likeness(present, past, thing)
            if likeness > self.present:
                found_past.append(Instance(mask & valid, "", min(1.0, likeness)))
            elif likeness > 0:
                before = self._snap(past, rough)
                if before is not None and _stands_out(past, before):
                    there = _placed(before, window, change.shape) & valid
                    found_past.append(Instance(there, "", score))
        return Objects(tuple(found_live), tuple(found_past))

    def _window(self, group: Crop, shape: tuple[int, ...]) -> tuple[slice, slice]:
        x0, y0, x1, y1 = group.box_xyxy
        margin = max(self.margin_px, (x1 - x0) // 3, (y1 - y0) // 3)
        rows = slice(max(0, y0 - margin), min(shape[0], y1 + margin))
        return rows, slice(max(0, x0 - margin), min(shape[1], x1 + margin))

    def _snap(self, image: Image, rough: Mask) -> Mask | None:
        """Return the union of the segments that the rough mask votes for, None without any."""
        labels: Labels = felzenszwalb(
            image, scale=self.scale, sigma=self.sigma, min_size=self.least_px
        )
        count = int(labels.max()) + 1
        sizes = np.bincount(labels.ravel(), minlength=count)
        votes = np.bincount(labels[rough], minlength=count)
        chosen = votes > self.vote * sizes
        thing: Mask = chosen[labels]
        if not thing.any():
            return None
        closed = cv2.morphologyEx(thing.view(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
        return np.asarray(closed, np.uint8).view(np.bool_)

    def _cut(self, image: Image, guess: Mask, rough: Mask) -> Mask:
        """Return the guess with its border moved to the colour edge; beyond reach is background.

        A cut that fits the change less than half as well has lost the object: the guess stands.
        """
        near = dilate(guess | rough, size_px=2 * self.reach_px + 1)
        # Both colour models need a pixel for each of their five colours.
        if min(int(np.count_nonzero(guess)), int(np.count_nonzero(~guess))) < 5:
            return guess
        labels = np.where(near, cv2.GC_PR_BGD, cv2.GC_BGD).astype(np.uint8)
        labels[guess] = cv2.GC_PR_FGD
        cv2.setRNGSeed(0)
        models = np.zeros((1, 65)), np.zeros((1, 65))
        picture = np.ascontiguousarray(image)
        cv2.grabCut(picture, labels, None, *models, self.iterations, cv2.GC_INIT_WITH_MASK)
        thing: Mask = labels == cv2.GC_PR_FGD
        fits = intersection_over_union(thing, rough) >= 0.5 * intersection_over_union(guess, rough)
        return thing if fits else guess


def _inside(group: Crop, window: tuple[slice, slice]) -> Mask:
    """The pixels of a joined component, in the window's frame."""
    rows, columns = window
    result = np.zeros((rows.stop - rows.start, columns.stop - columns.start), np.bool_)
    height, width = group.pixels.shape
    y, x = group.y - rows.start, group.x - columns.start
    result[y : y + height, x : x + width] = group.pixels
    return result


def _placed(part: Mask, window: tuple[slice, slice], shape: tuple[int, ...]) -> Mask:
    mask = np.zeros(shape, np.bool_)
    mask[window] = part
    return mask


def _contrast(image: Image, thing: Mask) -> Field:
    """Colour of a thing less the colour of the ring around it, CIELAB."""
    lab = cv2.cvtColor(image.astype(np.float32) / 255, cv2.COLOR_RGB2LAB)
    ring = dilate(thing, size_px=9) & ~dilate(thing, size_px=3)
    if not ring.any():
        return np.zeros(3, np.float32)
    return np.asarray(np.median(lab[thing], axis=0) - np.median(lab[ring], axis=0), np.float32)


def _likeness(present: Image, past: Image, thing: Mask) -> float:
    """Return how much of an object's contrast the reference shows there: 1 = all, 0 = none."""
    now, then = _contrast(present, thing), _contrast(past, thing)
    strength = float(now @ now)
    return float(now @ then) / strength if strength > 1.0 else 0.0


def _stands_out(image: Image, thing: Mask) -> bool:
    """Say whether a segment differs from what surrounds it, as an object does."""
    return bool(np.linalg.norm(_contrast(image, thing)) > 8.0)
