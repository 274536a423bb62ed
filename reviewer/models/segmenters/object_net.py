"""`object-net`: the click net without a person, near the detector's change mask.

Every changed component is clicked in its middle and looked at, with the component as the mask to
correct; the best rated mask is the object. Whether the reference has it too is asked by a search:
what is found again some pixels aside has not changed. What stands out in the reference only is an
object of the reference.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

from reviewer.masks import Mask, components, depth, dilate, intersection_over_union
from reviewer.models.clicks.net_clicks import NetClicks
from reviewer.models.interfaces import (
    Click,
    Embedding,
    Field,
    Image,
    Instance,
    Objects,
    PairView,
    Prompt,
)

RIM_PX = 3


@dataclass
class ObjectNetSegmenter:
    """Objects by the click net.

    Attributes:
        checkpoint: weights, a safetensors file; "" = those of the package.
        weights: fingerprint; where given, the file must still hold those.
        join_px: components closer than this are one object.
        least_px: smaller components are left alone.
        least_agreement: a mask whose IoU with the component is lower has lost the object.
        search_px: how far aside the reference is searched for the object.
        present: correlation at which it counts as found there.
    """

    checkpoint: str = ""
    weights: str = ""
    join_px: int = 5
    least_px: int = 10
    least_agreement: float = 0.3
    search_px: int = 12
    present: float = 0.8
    _clicks: NetClicks = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Load the weights; raises as `load_small`."""
        self._clicks = NetClicks.load(self.checkpoint)
        self.weights = self._clicks.check(self.weights)

    def segment(self, view: PairView) -> Objects:
        """Return one instance for each joined component, in the picture that has the object."""
        confidence = view.valid.astype(np.float32) if view.confidence is None else view.confidence
        change = view.change.astype(np.float32)
        present = self._clicks.embed(view.live, view.warped, confidence, change)
        past = self._clicks.embed(view.warped, view.live, confidence, change)
        found_live, found_past = [], []
        _, groups = components(dilate(view.change, size_px=self.join_px))
        for group in groups:
            rough = np.zeros_like(view.change)
            group.window(rough)[group.pixels] = True
            rough &= view.change
            if int(np.count_nonzero(rough)) < self.least_px:
                continue
            now, then = self._object(present, rough), self._object(past, rough)
            if _stands_out(view.warped, then.mask) > 1.5 * _stands_out(view.live, now.mask):
                found_past.append(Instance(then.mask & view.valid, "", then.score))
                continue
            found_live.append(now)
            if self._is_there(view.live, view.warped, now.mask):
                found_past.append(Instance(now.mask & view.valid, "", now.score))
        return Objects(tuple(found_live), tuple(i for i in found_past if i.mask.any()))

    def _object(self, embedding: Embedding, rough: Mask) -> Instance:
        """Return what the net makes of a component; itself where the net loses it."""
        y, x = np.unravel_index(int(depth(rough).argmax()), rough.shape)
        click = Click(float(x) + 0.5, float(y) + 0.5)
        best = self._clicks.predict(embedding, Prompt((click,), None, rough))[0]
        again = self._clicks.predict(embedding, Prompt((click,), None, best.mask))[0]
        for candidate in sorted((best, again), key=lambda c: -c.score):
            if intersection_over_union(candidate.mask, rough) >= self.least_agreement:
                return Instance(candidate.mask, "", candidate.score)
        return Instance(rough, "", 0.5)

    def _is_there(self, live: Image, warped: Image, thing: Mask) -> bool:
        """Say whether the reference shows the object, some pixels aside at most."""
        around = dilate(thing, size_px=2 * RIM_PX + 1)
        x, y, width, height = cv2.boundingRect(around.view(np.uint8))
        reach = self.search_px
        part, where = (each[y : y + height, x : x + width] for each in (live, around))
        padded = cv2.copyMakeBorder(warped, *(reach,) * 4, cv2.BORDER_REPLICATE)
        field_of_search = padded[y : y + height + 2 * reach, x : x + width + 2 * reach]
        scores = cv2.matchTemplate(
            field_of_search, part, cv2.TM_CCOEFF_NORMED, mask=where.view(np.uint8)
        )
        finite = scores[np.isfinite(scores)]
        return bool(finite.size and finite.max() > self.present)


def _stands_out(image: Image, thing: Mask) -> float:
    """Return how strong an edge the outline of a mask is, CIELAB a pixel."""
    x, y, width, height = cv2.boundingRect(thing.view(np.uint8))
    if not width:
        return 0.0
    window = np.s_[max(0, y - 4) : y + height + 4, max(0, x - 4) : x + width + 4]
    inside: Image = thing[window].view(np.uint8)
    lab = cv2.cvtColor(image[window].astype(np.float32) / 255, cv2.COLOR_RGB2LAB)
    kernel = np.ones((3, 3), np.uint8)
    inner = inside > cv2.erode(inside, kernel, iterations=2)
    outer = cv2.dilate(inside, kernel, iterations=3) > cv2.dilate(inside, kernel)
    if not (inner.any() and outer.any()):
        return 0.0
    # Each side of the outline, smoothed along it, so that noise is no edge.
    steps = _smoothed(lab, inner) - _smoothed(lab, outer)
    return float(np.linalg.norm(steps[inner | outer], axis=1).mean())


def _smoothed(lab: Field, where: Mask) -> Field:
    weight = cv2.GaussianBlur(where.astype(np.float32), (0, 0), 2.5)[..., None]
    total = cv2.GaussianBlur(lab * where[..., None].astype(np.float32), (0, 0), 2.5)
    return np.asarray(total / np.maximum(weight, 1e-3), np.float32)
