"""`dinov2`: change as the distance of a foundation model's early features; nothing is trained.

Patch tokens of a few early blocks still say what a place looks like, and forgive light and blur. A
place of one picture has changed when no place near it in the other looks like it; both pictures
are asked, since what was taken away is missing only in the live one. Where the distance becomes a
change is the pair's own: the cut of its histogram with the most entropy (Kapur et al., 1985), or so
many deviations above its median. With a SAM the found places take the shape of objects.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor
from transformers import AutoModel

from reviewer.errors import InvalidInput
from reviewer.masks import Mask, components
from reviewer.models.device import best_device, check_recorded, fingerprint
from reviewer.models.interfaces import Field, Image, ModelFailed, PairView
from reviewer.models.nets.pictures import prepare, stack_pair
from reviewer.models.segmenters.everything import SamEverythingSegmenter
from reviewer.models.weights.hub import load_pretrained
from reviewer.words import CUTS, Cut

Distances = npt.NDArray[np.float32]
INSTEAD = "name a directory or a hub id, or use --detector difference, which needs no weights"
LEVELS = 256
BORDER = 0.5
"""The probability at the cut, above which a place counts as changed here."""


@dataclass
class Dinov2Detector:
    """Distance of patch tokens, cut pair by pair.

    Attributes:
        checkpoint: DINOv2, with registers or without; a directory or a hub id.
        blocks: after which transformer blocks the tokens are compared, counted from 1; the mean of
            their distances counts.
        cell_px: side of the square of the picture that one patch stands for.
        reach: how many patches away the like of a place is looked for.
        cut: where a distance becomes a change: "entropy" or "mad".
        deviations: with "mad", how many deviations above the median.
        least_distance: lowest cut, so that a pair without change has none.
        steepness: logistic from distance over cut to probability.
        sam: "sam:PATH" or "sam2:PATH", a directory or a hub id; "" = places keep their shape.
        weights: fingerprints; where given, the checkpoints must still hold those.
    """

    checkpoint: str = "facebook/dinov2-base"
    blocks: Sequence[int] = (3, 6)
    cell_px: float = 8.0
    reach: int = 1
    cut: Cut = "entropy"
    deviations: float = 6.0
    least_distance: float = 0.15
    steepness: float = 6.0
    sam: str = ""
    weights: str = ""

    def __post_init__(self) -> None:
        """Load the nets.

        Raises:
            InvalidInput: when one cannot be loaded, has changed, or a setting makes no sense.
        """
        _check(self)
        net = load_pretrained(
            AutoModel,
            self.checkpoint,
            f"--detector dinov2:{self.checkpoint}",
            types={"dinov2", "dinov2_with_registers"},
            instead=INSTEAD,
        )
        depth = int(net.config.num_hidden_layers)
        if max(self.blocks) > depth:
            raise InvalidInput(
                f"detector dinov2: blocks are {list(self.blocks)},"
                f" but {self.checkpoint} has {depth}"
            )
        self._objects = SamEverythingSegmenter(self.sam) if self.sam else None
        found = [fingerprint(net), *([self._objects.weights] if self._objects else [])]
        self.weights = check_recorded(
            f"--detector dinov2:{self.checkpoint}", " ".join(found), self.weights
        )
        del net.encoder.layer[max(self.blocks) :]  # what lies behind is never looked at
        self._patch = int(net.config.patch_size)
        self._before = 1 + int(getattr(net.config, "num_register_tokens", 0))
        self._device = best_device()
        self._net = net.to(self._device).eval()

    def detect(self, warped: Image, live: Image, valid: Mask) -> Field:
        """Return the probability of change, float32 (H, W); 0 outside `valid`."""
        height, width = valid.shape
        # Where nothing can be compared the net is shown twice the same, not an edge to black.
        shown = np.where(valid[..., None], warped, live)
        rows, columns = (max(1, round(side / self.cell_px)) for side in (height, width))
        seen = cv2.resize(valid.astype(np.float32), (columns, rows), interpolation=cv2.INTER_AREA)
        known: Mask = np.asarray(seen >= 0.5)
        past, present = self._tokens(shown, live, rows, columns)
        by_block = [
            changed_distance(a, b, known, self.reach) for a, b in zip(past, present, strict=True)
        ]
        distances = np.stack(by_block).mean(axis=0)
        full = np.asarray(
            cv2.resize(distances, (width, height), interpolation=cv2.INTER_LINEAR), np.float32
        )
        limit = max(self._cut(distances[known]), self.least_distance)
        probability = 1 / (1 + np.exp(-self.steepness * (full / limit - 1)))
        if self._objects is not None:
            probability = snap(probability, self._masks(shown, live, valid), valid)
        probability[~valid] = 0
        return np.asarray(probability, np.float32)

    def _tokens(
        self, past: Image, present: Image, rows: int, columns: int
    ) -> tuple[list[Distances], list[Distances]]:
        """Return unit tokens (rows, columns, C) of each block: the reference's, the live one's."""
        size = (columns * self._patch, rows * self._patch)
        resized = [cv2.resize(i, size, interpolation=_how(i, size)) for i in (past, present)]
        pictures = torch.from_numpy(stack_pair(resized[0], resized[1])[None]).to(self._device)
        both = prepare(pictures, "imagenet").view(2, 3, *pictures.shape[-2:])
        try:
            with torch.inference_mode():
                states = self._net(both, output_hidden_states=True).hidden_states
        except torch.OutOfMemoryError as error:
            raise ModelFailed(
                f"dinov2: {rows} x {columns} patches do not fit into the memory of {self._device};"
                " use a larger cell_px"
            ) from error
        found: list[Tensor] = [states[block][:, self._before :].float() for block in self.blocks]
        units = [
            torch.nn.functional.normalize(f, dim=-1).view(2, rows, columns, -1).cpu().numpy()
            for f in found
        ]
        return [unit[0] for unit in units], [unit[1] for unit in units]

    def _cut(self, distances: Distances) -> float:
        if distances.size == 0:
            return self.least_distance
        if self.cut == "entropy":
            return most_entropy(distances)
        middle = float(np.median(distances))
        spread = 1.4826 * float(np.median(np.abs(distances - middle)))
        return middle + self.deviations * spread

    def _masks(self, warped: Image, live: Image, valid: Mask) -> list[Mask]:
        assert self._objects is not None
        still = np.zeros((*valid.shape, 2), np.float32)
        nothing = np.zeros_like(valid)
        found = self._objects.segment(PairView(live, warped, valid, nothing, (), warped, still))
        return [thing.mask for thing in (*found.live, *found.reference)]


def changed_distance(past: Distances, present: Distances, known: Mask, reach: int) -> Distances:
    """Return how unlike anything near it in the other picture each place is.

    Args:
        past, present: unit tokens, float32 (rows, columns, C).
        known: bool (rows, columns), the places that can be compared.
        reach: how many places away the other picture is searched, in rows and in columns.

    Returns:
        float32 (rows, columns), 1 - cosine in [0, 2]: the larger of the two ways; 0 where nothing
        is known.
    """
    forth, back = (np.full(known.shape, np.inf, np.float32) for _ in range(2))
    rows, columns = known.shape
    for dy in range(-reach, reach + 1):
        for dx in range(-reach, reach + 1):
            here = np.s_[max(0, -dy) : rows - max(0, dy), max(0, -dx) : columns - max(0, dx)]
            there = np.s_[max(0, dy) : rows - max(0, -dy), max(0, dx) : columns - max(0, -dx)]
            distance = 1 - np.einsum("ijc,ijc->ij", present[here], past[there])
            both = known[here] & known[there]
            forth[here] = np.where(both, np.minimum(forth[here], distance), forth[here])
            back[there] = np.where(both, np.minimum(back[there], distance), back[there])
    united = np.maximum(forth, back)
    return np.where(known, np.clip(united, 0, 2), 0).astype(np.float32)


def most_entropy(values: Distances) -> float:
    """Return the cut that leaves the most entropy in both parts of the histogram (Kapur et al.,
    CVGIP 1985, equation 18); the only value there is, where they are all alike."""
    low, high = float(values.min()), float(values.max())
    if low == high:
        return high
    counts, edges = np.histogram(values, LEVELS, (low, high))
    shares = counts / counts.sum()
    terms = -shares * np.log(np.where(shares > 0, shares, 1))
    below, inner = np.cumsum(shares)[:-1], np.cumsum(terms)[:-1]
    above, outer = 1 - below, terms.sum() - inner
    inside = (below > 0) & (above > 1e-12)
    below, above = np.where(inside, below, 1), np.where(inside, above, 1)
    entropy = np.log(below) + inner / below + np.log(above) + outer / above
    return float(edges[1 + int(np.argmax(np.where(inside, entropy, -np.inf)))])


def snap(probability: Field, masks: Sequence[Mask], valid: Mask) -> Field:
    """Give changed places the shape of the objects that they fill.

    An object whose mean probability is above 0.5 has it all over. What sticks out of such objects
    is cut off, provided that they hold at least half of the connected place; a place that no object
    explains stays as it is.
    """
    means = [(m & valid, float(probability[m & valid].mean())) for m in masks if (m & valid).any()]
    taken = [(mask, mean) for mask, mean in means if mean > BORDER]
    snapped = probability.copy()
    covered = np.zeros_like(valid)
    for mask, mean in taken:
        covered |= mask
        snapped[mask] = np.maximum(snapped[mask], mean)
    _, places = components((probability > BORDER) & valid)
    for place in places:
        outside = place.pixels & ~place.window(covered)
        if 2 * np.count_nonzero(outside) <= place.area:
            place.window(snapped)[outside] = 0
    return snapped


def _check(settings: Dinov2Detector) -> None:
    if settings.cut not in CUTS:
        raise InvalidInput(f"detector dinov2: cut is {settings.cut!r}, but must be entropy or mad")
    blocks: Any = settings.blocks
    counted = isinstance(blocks, list | tuple) and all(isinstance(b, int) and b > 0 for b in blocks)
    if not counted or not blocks:
        raise InvalidInput(
            f"detector dinov2: blocks are {blocks!r}, but must be a list of numbers counted from"
            " 1, such as [3, 6]"
        )
    for name, least in (("cell_px", 1.0), ("reach", 0), ("least_distance", 1e-6)):
        value = getattr(settings, name)
        if value < least:
            raise InvalidInput(f"detector dinov2: {name} is {value}, but must be >= {least:g}")


def _how(image: Image, size: tuple[int, int]) -> int:
    return cv2.INTER_AREA if size[0] < image.shape[1] else cv2.INTER_LINEAR
