"""What a scripted annotator decides to do: the cheapest steps that bring an object to the goal."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from objects import objects_of
from skimage.draw import polygon2mask

from reviewer.masks import Mask, boundary, components, dilate, fill_holes, intersection_over_union
from reviewer.models.interfaces import Click, ClickSegmenter, Embedding, Prompt

MOST_CLICKS = 3
MOST_DABS = 40
LARGEST_RADIUS = 30
NEAR_PX, SPECK_PX = 5, 20


@dataclass(frozen=True, slots=True)
class Step:
    """One thing to do: a tool, a key, a brush size (x), a click at an image point, a box to drag.

    "away-click" and "away-box" are done with Alt: they take away. "pick" selects the
    proposal of that key.
    """

    kind: str
    x: float = 0.0
    y: float = 0.0
    key: str = ""
    box: tuple[int, int, int, int] = (0, 0, 0, 0)
    settle: bool = False


@dataclass(frozen=True, slots=True)
class Plan:
    """Steps, what the mask will be, and the box to zoom to first, if any."""

    way: str
    steps: tuple[Step, ...]
    mask: Mask
    near: tuple[int, int, int, int] | None = None

    @property
    def cost(self) -> int:
        """Actions, zooming included."""
        return sum(step.kind != "candidate" for step in self.steps) + 2 * (self.near is not None)


def own_part(mask: Mask, thing: Mask, truth: Mask) -> Mask:
    """Return what of a mask stands for an object: the components that touch it, less the others."""
    part = np.zeros_like(mask)
    for crop in components(mask)[1]:
        if (crop.window(thing) & crop.pixels).any():
            crop.window(part)[crop.pixels] = True
    return part & ~(truth & ~thing)


def reached(part: Mask, thing: Mask, goal: float) -> bool:
    """Say whether a mask is good enough: by its IoU, or because each pixel of either border lies
    within a pixel of the other's: two careful people do not agree better on small things."""
    if intersection_over_union(part, thing) >= goal:
        return True
    if not part.any():
        return False
    mine, true = boundary(part), boundary(thing)
    return (
        not (mine & ~dilate(true, size_px=3)).any() and not (true & ~dilate(mine, size_px=3)).any()
    )


def plan_object(
    segmenter: ClickSegmenter,
    embedding: Embedding,
    mask: Mask,
    thing: Mask,
    truth: Mask,
    goal: float,
    proposed: Mapping[str, Mask],
) -> Plan:
    """Return the cheapest plan among accept, proposal, click, brush and polygon."""
    if reached(own_part(mask, thing, truth), thing, goal):
        return Plan("accept", (), mask)
    for key, pixels in proposed.items():
        for way, apply in WAYS.items():
            done = apply(mask, pixels)
            # What stands for another object stays.
            if not ((done ^ mask) & truth & ~thing).any() and reached(
                own_part(done, thing, truth), thing, goal
            ):
                return Plan("proposal", by_proposal(key, way), done)
    own = own_part(mask, thing, truth)
    starts = [_erase(mask, own & ~thing, thing)]
    if own.any() and not (truth & ~thing)[_slices(_box(own))].any():
        starts.append(away_box(mask, _box(own)))
    plans = [_clicks(segmenter, embedding, mask, thing, truth, goal)]
    for start in starts:
        outlined = plan_polygon(start.mask, thing, goal)
        steps = (*start.steps, *outlined.steps)
        plans.append(Plan("polygon", steps, outlined.mask, outlined.near))
        plans.append(_brush(start, thing, truth, goal))
    return min((plan for plan in plans if plan is not None), key=lambda plan: plan.cost)


def _clicks(
    segmenter: ClickSegmenter,
    embedding: Embedding,
    mask: Mask,
    thing: Mask,
    truth: Mask,
    goal: float,
) -> Plan | None:
    """Click in the middle of the largest error, look through the candidates, replace."""
    clicks: list[Click] = []
    steps = [Step("tool", key="c")]
    held = np.zeros_like(mask)
    for _ in range(MOST_CLICKS):
        errors = (thing & ~held, held & ~thing)
        error = max(errors, key=np.count_nonzero)
        if not error.any():
            return None
        x, y = deepest(error)
        positive = bool(thing[y, x])
        if not clicks and mask[y, x]:
            # A first click on a drawn part corrects that part.
            held = _part_at(mask, x, y)
        clicks.append(Click(x + 0.5, y + 0.5, positive))
        steps.append(Step("click" if positive else "right", x + 0.5, y + 0.5, settle=True))
        previous = held if held.any() else None
        found = segmenter.predict(embedding, Prompt(tuple(clicks), None, previous))
        for number, candidate in enumerate(found):
            done = _replaced(mask, candidate.mask)
            if reached(own_part(done, thing, truth), thing, goal):
                tabs = [Step("key", key="Tab")] * number
                return Plan("click", (*steps, *tabs, Step("key", key="r")), done)
        held = found[0].mask
    return None


def _part_at(mask: Mask, x: int, y: int) -> Mask:
    labels, _ = components(mask)
    return np.asarray(labels == labels[y, x])


def _replaced(mask: Mask, proposal: Mask) -> Mask:
    """As the workbench replaces: every component that the proposal touches gives way."""
    result = mask.copy()
    for crop in components(mask)[1]:
        if (crop.window(proposal) & crop.pixels).any():
            crop.window(result)[crop.pixels] = False
    return result | proposal


def by_proposal(key: str, way: str) -> tuple[Step, ...]:
    """Select a proposal in the list, which goes to its place; apply it; look at the whole again."""
    return Step("pick", key=key), Step("key", key=WAY_KEYS[way]), Step("key", key="f")


WAY_KEYS = {"add": "v", "replace": "r", "subtract": "d"}
WAYS: dict[str, Callable[[Mask, Mask], Mask]] = {
    "add": lambda mask, proposal: mask | proposal,
    "replace": _replaced,
    "subtract": lambda mask, proposal: mask & ~proposal,
}
"""What is made of a proposal."""


def _brush(erased: Plan, thing: Mask, truth: Mask, goal: float) -> Plan | None:
    """Dab discs that cover the most of what is missing."""
    steps, result = [*erased.steps, Step("tool", key="b")], erased.mask
    depth = _depth(thing)
    radius = 0.0
    for _ in range(MOST_DABS):
        if reached(own_part(result, thing, truth), thing, goal):
            return Plan("brush", tuple(steps), result, _box(thing))
        missing = thing & ~result
        if not missing.any():
            return None
        gain = np.where(missing, depth, 0)
        y, x = np.unravel_index(int(gain.argmax()), gain.shape)
        size = max(1.0, float(np.floor(2 * (depth[y, x] - 0.2)) / 2))
        if size != radius:
            steps.append(Step("radius", size))
            radius = size
        steps.append(Step("click", x + 0.5, y + 0.5))
        result = result | _disc(result.shape, x + 0.5, y + 0.5, radius)
    return None


def _erase(mask: Mask, wrong: Mask, thing: Mask) -> Plan:
    """Dab a wrong part away with discs that keep off the object."""
    steps: list[Step] = [Step("tool", key="e")] if wrong.any() else []
    rest, radius = wrong.copy(), 0.0
    free = _depth(~thing) - 0.5
    for _ in range(MOST_DABS):
        if not rest.any():
            break
        room = np.where(rest, np.minimum(free, LARGEST_RADIUS), 0)
        y, x = np.unravel_index(int(room.argmax()), room.shape)
        size = max(1.0, float(np.floor(2 * room[y, x]) / 2))
        if size != radius:
            steps.append(Step("radius", size))
            radius = size
        steps.append(Step("click", x + 0.5, y + 0.5))
        rest &= ~_disc(mask.shape, x + 0.5, y + 0.5, radius)
        mask = mask & ~_disc(mask.shape, x + 0.5, y + 0.5, radius)
    return Plan("erase", tuple(steps), mask)


def _depth(mask: Mask) -> npt.NDArray[np.float32]:
    """Distance of each pixel to the nearest one outside the mask."""
    inside = np.pad(mask, 1).astype(np.uint8)
    distance = cv2.distanceTransform(inside, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.asarray(distance[1:-1, 1:-1], np.float32)


def plan_polygon(mask: Mask, thing: Mask, goal: float) -> Plan:
    """Outline an object with as few corners as reach the goal; its large holes are taken out."""
    solid = fill_holes(thing)
    corners = outline(solid, goal)
    steps = [Step("tool", key="q"), *_outlined(corners, "click")]
    filled = fill(corners, thing.shape)
    for crop in sorted(components(solid & ~thing)[1], key=lambda crop: -crop.area):
        if intersection_over_union(filled, thing) >= goal:
            break
        hole = np.zeros_like(thing)
        crop.window(hole)[...] = crop.pixels
        corners = outline(hole, goal)
        steps += _outlined(corners, "away-click")
        filled = filled & ~fill(corners, thing.shape)
    return Plan("polygon", tuple(steps), mask | filled, _box(thing))


def _outlined(corners: Sequence[tuple[float, float]], kind: str) -> list[Step]:
    return [*(Step(kind, x, y) for x, y in corners), Step("key", key="Enter")]


def away_box(mask: Mask, box: tuple[int, int, int, int]) -> Plan:
    """Take away everything in a box."""
    x0, y0, x1, y1 = box
    rest = mask.copy()
    rest[y0:y1, x0:x1] = False
    return Plan("box", (Step("tool", key="x"), Step("away-box", box=box)), rest)


def plan_pair(
    segmenter: ClickSegmenter,
    embedding: Embedding,
    mask: Mask,
    truth: Mask,
    goal: float,
    least: int,
    proposed: Mapping[str, Mask],
) -> list[Plan]:
    """Return the cheaper of two ways: correct what is there, or wipe it and begin from nothing."""
    height, width = mask.shape
    wiped = away_box(mask, (0, 0, width, height))
    ways = [_reject_false_alarms(mask, truth, proposed), [wiped] if mask.any() else []]
    for plans in ways:
        now = plans[-1].mask if plans else mask
        for thing in objects_of(truth, least):
            plans.append(plan_object(segmenter, embedding, now, thing, truth, goal, proposed))
            now = plans[-1].mask
    return min(ways, key=lambda plans: sum(plan.cost for plan in plans))


def _reject_false_alarms(mask: Mask, truth: Mask, proposed: Mapping[str, Mask]) -> list[Plan]:
    """Drop specks if that harms nothing, then take out each component far from truth: by the
    proposal that covers it, else by a box around it."""
    near = dilate(truth, size_px=2 * NEAR_PX + 1)
    plans: list[Plan] = []
    specks = [crop for crop in components(mask)[1] if crop.area < SPECK_PX]
    alarms = [crop for crop in specks if not (crop.window(near) & crop.pixels).any()]
    if len(alarms) > 1 and len(alarms) == len(specks):
        mask = mask.copy()
        for crop in specks:
            crop.window(mask)[crop.pixels] = False
        plans.append(Plan("drop specks", (Step("key", key="Shift+D"),), mask))
    for crop in components(mask)[1]:
        if not (crop.window(near) & crop.pixels).any():
            now = plans[-1].mask if plans else mask
            part = np.zeros_like(mask)
            crop.window(part)[crop.pixels] = True
            fits = (
                key
                for key, pixels in proposed.items()
                if not (part & ~pixels).any() and not (pixels & truth & now).any()
            )
            if key := next(fits, None):
                plans.append(Plan("take out", by_proposal(key, "subtract"), now & ~proposed[key]))
            elif (part & now).any():
                plans.append(away_box(now, crop.box_xyxy))
    return plans


def outline(thing: Mask, goal: float) -> Sequence[tuple[float, float]]:
    """Return the coarsest polygon of a component that is still good enough."""
    fine = 8
    large = np.kron(np.pad(thing, 1), np.ones((fine, fine), np.uint8)).astype(np.uint8)
    contours, _ = cv2.findContours(large, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    contour = max(contours, key=cv2.contourArea)
    best = contour
    for epsilon in np.geomspace(0.3 * fine, 40 * fine, 60):
        tried = cv2.approxPolyDP(contour, float(epsilon), True)
        if len(tried) < 3:
            break
        if intersection_over_union(fill(_scaled(tried, fine), thing.shape), thing) >= goal + 0.02:
            best = tried if len(tried) < len(best) else best
    return _from_the_loneliest(_scaled(best, fine))


def _from_the_loneliest(corners: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Begin at the corner that is farthest from all others: a click near the first one closes."""
    points = np.array(corners)
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    start = int(apart.min(axis=1).argmax())
    return corners[start:] + corners[:start]


def _scaled(contour: np.ndarray, fine: int) -> list[tuple[float, float]]:
    points = (contour.reshape(-1, 2) + 0.5) / fine - 1
    return [(float(x), float(y)) for x, y in points]


def fill(corners: Sequence[tuple[float, float]], shape: tuple[int, ...]) -> Mask:
    """Return the pixels whose centres lie inside a polygon."""
    rows_first = np.array([(y - 0.5, x - 0.5) for x, y in corners])
    return np.asarray(polygon2mask(shape, rows_first), np.bool_)


def deepest(mask: Mask) -> tuple[int, int]:
    """Return the pixel (x, y) farthest from everything outside the mask."""
    depth = _depth(mask)
    y, x = np.unravel_index(int(depth.argmax()), depth.shape)
    return int(x), int(y)


def _disc(shape: tuple[int, ...], x: float, y: float, radius: float) -> Mask:
    """As the workbench paints a dab: pixel centres within the radius."""
    rows, columns = np.ogrid[: shape[0], : shape[1]]
    return np.asarray((rows + 0.5 - y) ** 2 + (columns + 0.5 - x) ** 2 <= radius * radius)


def _slices(box: tuple[int, int, int, int]) -> tuple[slice, slice]:
    return slice(box[1], box[3]), slice(box[0], box[2])


def _box(mask: Mask) -> tuple[int, int, int, int]:
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1
