"""Two views of one made-up place: parallax, occlusion, other light, and things that came or went.

A background is moved by a homography and a smooth relief; standing things lie before it, each at a
depth of its own, so that they hide other parts of it in the two views. What changed is in one view
only. The true flow and what the reference shows are known for every pixel.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import cv2
import numpy as np
import numpy.typing as npt

from reviewer.masks import Mask
from reviewer.models.warping import targets
from reviewer.synthesis.bank import Bank, Cutout
from reviewer.synthesis.jitter import Flow, photograph, relight
from reviewer.synthesis.paste import Picture, Placed, Rng, lay, mark, place
from reviewer.synthesis.settings import SynthesisSettings

Image = npt.NDArray[np.uint8]
MARGIN = 0.25
"""How much farther than the view a background reaches on every side, as a share of the view."""
INVERTING_STEPS = 8
LEAST_PX = 10


@dataclass(frozen=True, slots=True)
class ViewSettings:
    """How two views of a place differ.

    Attributes:
        side: of the square pictures, pixels.
        still: share of pairs whose camera hardly moved (below 2 pixels).
        motion: largest move of a corner as a share of the side, turn and zoom included.
        relief_px: largest standard deviation of the smooth parallax.
        clutter: most things that lie flat on the background.
        standing: most things that both views show.
        standing_px, changed_px: their longest sides, uniform in the logarithm.
        parallax_px: largest move of a standing thing against its background.
        moved: probability that a thing that came had only been moved.
        gamma: largest exponent of the tone curve, up or down.
        jpeg: share of the pictures that are JPEG-compressed.
        look: how things are laid, and light, noise and blur.
    """

    side: int = 320
    still: float = 0.35
    motion: float = 0.12
    relief_px: float = 6.0
    clutter: int = 14
    standing: int = 6
    standing_px: tuple[float, float] = (16.0, 200.0)
    changed_px: tuple[float, float] = (6.0, 160.0)
    parallax_px: float = 14.0
    moved: float = 0.15
    gamma: float = 1.15
    jpeg: float = 0.5
    look: SynthesisSettings = field(
        default_factory=lambda: SynthesisSettings(
            changes=(0, 4), exposure=1.3, colour_cast=1.08, shade=0.3, noise=8.0, blur_px=1.2
        )
    )


@dataclass(frozen=True, slots=True)
class Changed:
    """A thing that one view has.

    Attributes:
        mask: bool (H, W), its pixels in the live frame, by the true flow where it went.
        came: whether it is in the live view; else it went, and is in the reference.
        own: bool (H, W), its pixels in the frame of the view that has it.
    """

    mask: Mask
    came: bool
    own: Mask


@dataclass(frozen=True, slots=True)
class Views:
    """Two pictures of a place.

    Attributes:
        reference, live: uint8 RGB (H, W, 3).
        flow: float32 (H, W, 2), live (x, y) shows reference (x + dx, y + dy) of what stands there.
        seen: bool (H, W), live pixels whose place the reference shows.
        changed: what came and went, its visible pixels.
        standing: bool masks (H, W) of what stands in both, visible pixels of the live view.
    """

    reference: Image
    live: Image
    flow: Flow
    seen: Mask
    changed: tuple[Changed, ...]
    standing: tuple[Mask, ...]


def make_views(background: Image, bank: Bank, settings: ViewSettings, rng: Rng) -> Views:
    """Make two views before a background of any size; the same for the same generator state."""
    side = settings.side
    flow = _motion(round(side * (1 + 2 * MARGIN)), settings, rng)
    start = (len(flow) - side) // 2
    inner = (slice(start, start + side), slice(start, start + side))
    canvas = _canvas(background, len(flow), rng)
    look = replace(settings.look, size_px=settings.standing_px)
    for _ in range(int(settings.clutter * float(rng.random()) ** 1.5)):
        lay(canvas, place(_drawn(bank, rng), canvas, look, rng))
    backward = _inverse(flow)
    present = canvas[inner].copy()
    past = _remapped(canvas, backward)[inner].copy()
    flow = flow[inner].copy()
    owners = _Owners.empty(side)
    laid = _lay_standing(present, past, flow, owners, bank, settings, rng)
    came, went = _lay_changed(present, past, flow, owners, bank, settings, rng)
    hidden = cv2.remap(
        owners.past.astype(np.float32), *targets(flow), cv2.INTER_NEAREST, borderValue=-1
    )
    seen = hidden == owners.present
    for number in (*came, *went):
        seen |= (owners.present == number) | (hidden == number)
    seen &= hidden >= 0
    changed = [Changed(m := owners.present == n, True, m) for n in came]
    for number in went:
        left = (hidden == number) & ~np.isin(owners.present, came)
        changed.append(Changed(left, False, owners.past == number))
    past_blurred = bool(rng.random() < 0.5)
    return Views(
        taken(past, settings, rng, blurred=past_blurred),
        taken(present, settings, rng, blurred=not past_blurred),
        flow,
        seen,
        tuple(c for c in changed if np.count_nonzero(c.mask) >= LEAST_PX),
        tuple(m for n in laid if np.count_nonzero(m := owners.present == n) >= LEAST_PX),
    )


@dataclass(slots=True)
class _Owners:
    """Which thing each pixel shows: int32 (H, W), 0 = background."""

    present: npt.NDArray[np.int32]
    past: npt.NDArray[np.int32]
    count: int = 0

    @classmethod
    def empty(cls, side: int) -> _Owners:
        return cls(np.zeros((side, side), np.int32), np.zeros((side, side), np.int32))

    def next(self) -> int:
        self.count += 1
        return self.count


def _lay_standing(
    present: Picture, past: Picture, flow: Flow, owners: _Owners, bank: Bank,
    settings: ViewSettings, rng: Rng,
) -> list[int]:  # fmt: skip
    look = replace(settings.look, size_px=settings.standing_px, rotation_degrees=30.0)
    numbers = []
    for _ in range(int(rng.integers(0, settings.standing + 1))):
        placed = place(_drawn(bank, rng), present, look, rng)
        if placed is None:
            continue
        number = owners.next()
        reach = settings.parallax_px * float(rng.random()) ** 2
        dx, dy = _shift(flow, placed) + rng.normal(0, 1, 2) * (reach, 0.4 * reach)
        dx, dy = round(float(dx)), round(float(dy))
        before = replace(placed, x=placed.x + dx, y=placed.y + dy)
        lay(present, placed)
        lay(past, before)
        _own(owners.present, placed, number)
        _own(owners.past, before, number)
        flow[owners.present == number] = (dx, dy)
        numbers.append(number)
    return numbers


def _lay_changed(
    present: Picture, past: Picture, flow: Flow, owners: _Owners, bank: Bank,
    settings: ViewSettings, rng: Rng,
) -> tuple[list[int], list[int]]:  # fmt: skip
    look = replace(settings.look, size_px=settings.changed_px)
    came, went = [], []
    for _ in range(int(rng.integers(look.changes[0], look.changes[1] + 1))):
        cutout = _drawn(bank, rng)
        leaves = bool(rng.random() < look.removal)
        if not leaves:
            placed = place(cutout, present, look, rng)
            if placed is None:
                continue
            came.append(owners.next())
            lay(present, placed)
            _own(owners.present, placed, came[-1])
        if leaves or rng.random() < settings.moved:
            placed = place(cutout, past, look, rng)
            if placed is None:
                continue
            went.append(owners.next())
            lay(past, placed)
            _own(owners.past, placed, went[-1])
    return came, went


def _drawn(bank: Bank, rng: Rng) -> Cutout:
    return bank.objects[int(rng.integers(0, len(bank.objects)))]


def _own(owner: npt.NDArray[np.int32], placed: Placed, number: int) -> None:
    covered = np.zeros(owner.shape, np.bool_)
    mark(covered, placed)
    owner[covered] = number


def _shift(flow: Flow, placed: Placed) -> npt.NDArray[np.float32]:
    """Return how the background moves behind the middle of a thing."""
    height, width = placed.alpha.shape
    x = min(max(placed.x + width // 2, 0), flow.shape[1] - 1)
    y = min(max(placed.y + height // 2, 0), flow.shape[0] - 1)
    return np.asarray(flow[y, x])


def _motion(side: int, settings: ViewSettings, rng: Rng) -> Flow:
    """Return the relative flow of the background: a homography and a smooth relief."""
    still = rng.random() < settings.still
    reach = 2.0 if still else settings.side * settings.motion * float(rng.random())
    corners = np.array([[0, 0], [side, 0], [side, side], [0, side]], np.float32)
    # Most of a camera's motion is common to all corners; the rest turns, zooms and tilts.
    common = rng.uniform(-reach, reach, 2)
    moved = corners + (common + rng.uniform(-reach, reach, (4, 2)) * 0.5).astype(np.float32)
    matrix = cv2.getPerspectiveTransform(corners, moved.astype(np.float32))
    x, y = np.meshgrid(np.arange(side, dtype=np.float32), np.arange(side, dtype=np.float32))
    grid = np.stack([x, y], axis=-1)
    flow = cv2.perspectiveTransform(grid.reshape(-1, 1, 2), matrix).reshape(grid.shape) - grid
    relief = settings.relief_px * float(rng.random()) ** 2 * (0.15 if still else 1.0)
    knots = rng.normal(0, relief, (int(rng.integers(3, 9)),) * 2).astype(np.float32)
    depth = cv2.resize(knots, (side, side), interpolation=cv2.INTER_CUBIC)
    # Parallax has one direction, the camera's.
    angle = rng.uniform(-0.4, 0.4)
    flow[..., 0] += depth * np.cos(angle)
    flow[..., 1] += depth * np.sin(angle)
    return np.asarray(flow, np.float32)


def _inverse(flow: Flow) -> Flow:
    """Return the flow of the other direction, by fixed point: g(y) = -f(y + g(y))."""
    backward = -flow
    for _ in range(INVERTING_STEPS):
        backward = -_remapped(flow, backward)
    return backward


def _remapped(field_or_picture: Picture, flow: Flow) -> Picture:
    moved = cv2.remap(
        field_or_picture, *targets(flow), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT_101
    )
    return np.asarray(moved, np.float32)


def _canvas(background: Image, side: int, rng: Rng) -> Picture:
    """Cut a square out of a background at a random scale, turned by quarter turns and mirrored."""
    shortest = min(background.shape[:2])
    # Between a close look and the whole picture; small surfaces are repeated by reflection.
    cut = int(np.exp(rng.uniform(np.log(min(0.5 * side, shortest)), np.log(shortest))))
    top, left = (int(rng.integers(0, n - cut + 1)) for n in background.shape[:2])
    piece = background[top : top + cut, left : left + cut]
    piece = np.rot90(piece, int(rng.choice([0, 0, 0, 1, 2, 3])))
    if rng.random() < 0.5:
        piece = piece[:, ::-1]
    method = cv2.INTER_AREA if cut > side else cv2.INTER_CUBIC
    if cut < 0.6 * side:
        piece = np.concatenate([piece, piece[:, ::-1]], axis=1)
        piece = np.concatenate([piece, piece[::-1]], axis=0)
    return np.asarray(
        cv2.resize(np.ascontiguousarray(piece), (side, side), interpolation=method), np.float32
    )


def taken(picture: Picture, settings: ViewSettings, rng: Rng, *, blurred: bool) -> Image:
    """Return the picture as a camera takes it: light, tone curve, blur, noise, compression."""
    lit = np.clip(relight(picture, settings.look, rng), 0, 255)
    exponent = settings.gamma ** float(rng.uniform(-1, 1))
    toned = np.asarray(255 * (lit / 255) ** exponent, np.float32)
    image = photograph(toned, settings.look, rng, blurred=blurred)
    if rng.random() >= settings.jpeg:
        return image
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(60, 97))])
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)
