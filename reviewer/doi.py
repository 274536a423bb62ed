"""Degree of ill-posedness: the equation, the decision rule, and the integration of a pair.

DoI = f_b(O_l, O_r) x (1 - IoU(O_l, M_o)), Takeda et al., "Zero-shot Degree of Ill-posedness
Estimation for Active Small Object Change Detection", section "Integration Module". f_b is 1 iff
the two masks do not overlap; O_l is adopted iff 0 < DoI < 0.9, else M_o is kept.

Pure functions on bool (H, W) masks, True = changed or object; nothing here reads a file or knows
the store. Callers: `pipeline.work`, `store` views by way of the records, the app's audit.

Where the paper is open: scope `image` is the equation as written (one region a pair); scope
`component` judges each live object against the 8-connected components of M_o that it touches. A
variant of ours, seen = "reject", takes out of M_o what the reference shows an object at (f_b = 0),
where the paper keeps it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import get_args

import numpy as np
import numpy.typing as npt

from reviewer.errors import InvalidInput
from reviewer.masks import Crop, Mask, as_mask, components, crop_to_box, intersection_over_union
from reviewer.words import Choice, Overlaps, Reason, Scope, Seen

LOW = 0.0
HIGH = 0.9


@dataclass(frozen=True, slots=True)
class Decision:
    """What the strict rule says of one DoI; `inspect` asks the robot to look again."""

    adopt: bool
    inspect: bool


@dataclass(frozen=True, slots=True)
class Region:
    """One region under DoI: the terms of the equation, the decision, and what it touches.

    Attributes:
        object_indices: the live objects that make up O_l (scope `component`: one, or none).
        component_indices: the 8-connected components of M_o that make up m.
        overlap_px: pixels shared by O_l and O_r inside the valid warp.
        f_b: 1 when overlap_px <= max_overlap_px, else 0; 0 as well where nothing can be compared.
        iou: IoU(O_l, m) inside the valid warp, in [0, 1].
        doi: f_b * (1 - iou), in [0, 1].
        choice: "adopt" the object, "keep" the detector's components, or "reject" both.
        inspect: DoI >= high.
        reason: why, see `Reason`.
        box_xyxy: box around object and components, pixels; None when both are empty.
    """

    object_indices: tuple[int, ...]
    component_indices: tuple[int, ...]
    overlap_px: int
    f_b: int
    iou: float
    doi: float
    choice: Choice
    inspect: bool
    reason: Reason
    box_xyxy: tuple[int, int, int, int] | None


@dataclass(frozen=True, slots=True)
class Integration:
    """The final mask of a pair, bool (H, W), and one record per region."""

    mask: Mask
    regions: tuple[Region, ...]


def degree_of_ill_posedness(
    live: Mask, reference: Mask, change: Mask, *, max_overlap_px: int = 0
) -> float:
    """Compute the paper's DoI = f_b(O_l, O_r) * (1 - IoU(O_l, M_o)) in [0, 1].

    Args:
        live: O_l, bool (H, W), objects in the live image.
        reference: O_r, bool (H, W), objects in the reference image, in the live frame.
        change: M_o, bool (H, W), the detector's change mask.
        max_overlap_px: overlap that still counts as none; the paper's f_b has 0.

    Raises:
        InvalidInput: when the masks are not boolean or differ in size.
    """
    for name, mask in (("O_l", live), ("O_r", reference), ("M_o", change)):
        _check(name, mask, as_mask(change, name="M_o").shape)
    if int(np.count_nonzero(live & reference)) > max_overlap_px:
        return 0.0
    return 1.0 - intersection_over_union(live, change)


def decide(doi: float, *, low: float = LOW, high: float = HIGH) -> Decision:
    """Adopt O_l iff low < doi < high, strictly; flag `inspect` iff doi >= high.

    Raises:
        InvalidInput: when doi lies outside [0, 1] (a NaN does) or low > high.
    """
    if not 0.0 <= doi <= 1.0:
        raise InvalidInput(f"DoI: must lie in [0, 1], but is {doi}")
    if low > high:
        raise InvalidInput(f"DoI thresholds: low must not exceed high, but {low} > {high}")
    return Decision(adopt=low < doi < high, inspect=doi >= high)


def integrate(
    change: Mask,
    live_objects: Sequence[Mask],
    reference_objects: Sequence[Mask],
    *,
    scope: Scope = "component",
    valid: Mask | None = None,
    low: float = LOW,
    high: float = HIGH,
    max_overlap_px: int = 0,
    overlaps: Overlaps = "best",
    touching_only: bool = False,
    seen: Seen = "keep",
) -> Integration:
    """Decide every region of a pair and compose the final mask.

    Args:
        change: M_o, bool (H, W).
        live_objects: instances of O_l, bool (H, W) each.
        reference_objects: instances of O_r in the live frame, bool (H, W) each.
        scope: "image" (one region, whole masks) or "component" (one region an object, and one a
            component that no object touches).
        valid: bool (H, W), where the warped reference has pixels; f_b and IoU look only there.
        low, high: thresholds of `decide`.
        max_overlap_px: tolerance of f_b.
        overlaps: which of several adoptable objects on one component are adopted.
        touching_only: scope "image": O_l holds only the instances that share a pixel with M_o.
        seen: what becomes of a region with f_b = 0 that the warp shows: "keep" M_o (the paper) or
            "reject" its components.

    Raises:
        InvalidInput: when a mask has another size than `change`, or a setting is unknown.
    """
    shape = as_mask(change, name="M_o").shape
    for name, masks in (("live object", live_objects), ("reference object", reference_objects)):
        for index, mask in enumerate(masks):
            _check(f"{name} {index}", mask, shape)
    reference = np.zeros(shape, np.bool_)
    for crop in map(crop_to_box, reference_objects):
        if crop is not None:
            crop.window(reference)[...] |= crop.pixels
    return integrate_crops(
        change,
        [crop_to_box(mask) for mask in live_objects],
        reference,
        scope=scope,
        valid=valid,
        low=low,
        high=high,
        max_overlap_px=max_overlap_px,
        overlaps=overlaps,
        touching_only=touching_only,
        seen=seen,
    )


def integrate_crops(
    change: Mask,
    live_objects: Sequence[Crop | None],
    reference: Mask,
    *,
    scope: Scope = "component",
    valid: Mask | None = None,
    low: float = LOW,
    high: float = HIGH,
    max_overlap_px: int = 0,
    overlaps: Overlaps = "best",
    touching_only: bool = False,
    seen: Seen = "keep",
) -> Integration:
    """Do what `integrate` does, for objects that are cut out already.

    Args:
        live_objects: instances of O_l; None for an empty one, which keeps its number.
        reference: O_r, bool (H, W), all instances together.

    Raises:
        InvalidInput: as `integrate`.
    """
    shape = as_mask(change, name="M_o").shape
    _check("O_r", reference, shape)
    if valid is not None:
        _check("valid warp", valid, shape)
    given = {"scope": (scope, Scope), "overlaps": (overlaps, Overlaps), "seen": (seen, Seen)}
    for name, (value, known) in given.items():
        if value not in get_args(known):
            raise InvalidInput(f"DoI settings: unknown {name} {value!r}")
    decide(0.0, low=low, high=high)
    labels, parts = components(change)
    objects = {i: crop for i, crop in enumerate(live_objects) if crop is not None}
    pair = _Pair(change, labels, parts, objects, reference, valid, low, high, max_overlap_px, seen)
    if scope == "image":
        used = [i for i in objects if not touching_only or pair.touched_by(i)]
        compared = [i for i in used if pair.shown(objects[i]).any()]
        regions = [pair.judge(tuple(compared or used), tuple(range(len(parts))))]
    else:
        regions = _judge_objects(pair)
        if overlaps == "best":
            regions = _best_of_each_component(regions)
    return Integration(_compose(pair, regions, {}), tuple(regions))


def compose(
    change: Mask,
    live_objects: Sequence[Mask],
    regions: Sequence[Region],
    verdicts: Mapping[int, Choice] | None = None,
) -> Mask:
    """Rebuild the final mask from the regions, with people's verdicts in place of decisions.

    "adopt" puts the object in place of the region's components, "keep" leaves the components,
    "reject" removes both. A component is gone when any region that holds it adopts or rejects.

    Args:
        verdicts: region index -> choice; regions without one keep their own choice.
    """
    labels, parts = components(change)
    objects = {i: crop for i, m in enumerate(live_objects) if (crop := crop_to_box(m)) is not None}
    nowhere = np.zeros(change.shape, np.bool_)
    pair = _Pair(change, labels, parts, objects, nowhere, None, LOW, HIGH, 0, "keep")
    return _compose(pair, regions, verdicts or {})


@dataclass(frozen=True, slots=True)
class _Pair:
    """A pair cut into crops: everything below works on boxes, never on whole images."""

    change: Mask
    labels: npt.NDArray[np.int32]
    parts: list[Crop]
    objects: dict[int, Crop]
    reference: Mask
    valid: Mask | None
    low: float
    high: float
    max_overlap_px: int
    seen: Seen

    def touched_by(self, index: int) -> tuple[int, ...]:
        """Indices of the components that share a pixel with a live object, ascending."""
        crop = self.objects[index]
        # Counting by label costs one pass over the object's box, whatever the number of components.
        present = np.bincount(crop.window(self.labels)[crop.pixels], minlength=1)
        return tuple(int(n) - 1 for n in np.flatnonzero(present) if n > 0)

    def shown(self, crop: Crop) -> Mask:
        """The part of a crop that lies inside the valid warp."""
        return crop.pixels if self.valid is None else crop.pixels & crop.window(self.valid)

    def judge(self, object_indices: tuple[int, ...], component_indices: tuple[int, ...]) -> Region:
        """Evaluate the equation for one group of live objects and one group of components."""
        found = _joined([self.objects[i] for i in object_indices])
        parts = [self.parts[i] for i in component_indices]
        area = overlap = shared = 0
        if found is not None:
            shown = self.shown(found)
            area = int(np.count_nonzero(shown))
            overlap = int(np.count_nonzero(shown & found.window(self.reference)))
            shared = int(np.count_nonzero(shown & found.window(self.change)))
        part_area = sum(int(np.count_nonzero(self.shown(p))) for p in parts)
        either = area + part_area - shared
        iou = shared / either if either else 0.0
        # What no pixel can be compared of was neither seen in the reference nor missed there: f_b
        # is undefined. DoI = 0 leaves M_o as it is, and adopts nothing that nothing speaks for.
        hidden = bool(parts or found) and (part_area if found is None else area) == 0
        f_b = 0 if hidden else int(overlap <= self.max_overlap_px)
        doi = f_b * (1.0 - iou)
        decision = decide(doi, low=self.low, high=self.high)
        reason = self._reason(found, hidden, f_b, decision)
        choice: Choice = "adopt" if reason == "between_thresholds" else "keep"
        if reason == "seen_in_reference":
            choice = self.seen
        crops = parts if found is None else [found, *parts]
        return Region(
            object_indices,
            component_indices,
            overlap,
            f_b,
            iou,
            doi,
            choice,
            decision.inspect,
            reason,
            _around(crops),
        )

    def _reason(self, found: Crop | None, hidden: bool, f_b: int, decision: Decision) -> Reason:
        if not self.parts:
            return "no_detection"
        if hidden:
            return "outside_warp"
        if found is None:
            return "no_object"
        if f_b == 0:
            return "seen_in_reference"
        if decision.adopt:
            return "between_thresholds"
        return "too_ill_posed" if decision.inspect else "agrees"


def _check(name: str, mask: Mask, shape: tuple[int, ...]) -> None:
    if as_mask(mask, name=name).shape != shape:
        raise InvalidInput(
            f"{name}: must have the size of M_o, {shape[1]}x{shape[0]}, "
            f"but is {mask.shape[1]}x{mask.shape[0]}"
        )


def _judge_objects(pair: _Pair) -> list[Region]:
    regions = []
    untouched = set(range(len(pair.parts)))
    for index in pair.objects:
        numbers = pair.touched_by(index)
        untouched.difference_update(numbers)
        regions.append(pair.judge((index,), numbers))
    return regions + [pair.judge((), (number,)) for number in sorted(untouched)]


def _best_of_each_component(regions: list[Region]) -> list[Region]:
    # The best fitting object takes its components first. One that comes later and needs any of them
    # is not adopted at all, so that no component is replaced twice.
    taken: set[int] = set()
    result = list(regions)
    for i in sorted(range(len(regions)), key=lambda i: (-regions[i].iou, i)):
        region = regions[i]
        if region.choice != "adopt":
            continue
        if taken.intersection(region.component_indices):
            result[i] = replace(region, choice="keep", reason="better_object")
        else:
            taken.update(region.component_indices)
    return result


def _compose(pair: _Pair, regions: Sequence[Region], verdicts: Mapping[int, Choice]) -> Mask:
    mask = pair.change.copy()
    adopted: list[Crop] = []
    for index, region in enumerate(regions):
        choice = verdicts.get(index, region.choice)
        if choice == "keep":
            continue
        for number in region.component_indices:
            part = pair.parts[number]
            part.window(mask)[part.pixels] = False
        if choice == "adopt":
            adopted += [pair.objects[i] for i in region.object_indices]
    # Objects are laid on last: one may lie over a component that another region took away.
    for crop in adopted:
        crop.window(mask)[...] |= crop.pixels
    return mask


def _joined(crops: Sequence[Crop]) -> Crop | None:
    if len(crops) < 2:
        return crops[0] if crops else None
    x0, y0, x1, y1 = _around(crops) or (0, 0, 0, 0)
    pixels = np.zeros((y1 - y0, x1 - x0), np.bool_)
    for crop in crops:
        height, width = crop.pixels.shape
        pixels[crop.y - y0 : crop.y - y0 + height, crop.x - x0 : crop.x - x0 + width] |= crop.pixels
    return Crop(x0, y0, pixels, int(np.count_nonzero(pixels)))


def _around(crops: Sequence[Crop]) -> tuple[int, int, int, int] | None:
    if not crops:
        return None
    boxes = [crop.box_xyxy for crop in crops]
    return (
        min(b[0] for b in boxes),
        min(b[1] for b in boxes),
        max(b[2] for b in boxes),
        max(b[3] for b in boxes),
    )
