"""What a synthetic pair looks like, as one record that is stored with each training."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from reviewer.errors import InvalidInput

Range = tuple[float, float]


@dataclass(frozen=True, slots=True)
class SynthesisSettings:
    """How many objects, how they are pasted, and how the two pictures of a pair differ otherwise.

    The paper says: a COCO object of random size at a random place on a reference image. All else
    is ours, so that a net meets in training what alignment and another hour of the day leave over.

    Attributes:
        changes: fewest and most objects that only one picture of a pair has.
        unchanged: most objects that both pictures have, so that "is an object" is not the answer.
        size_px: longest side of an object, pixels; uniform in its logarithm.
        rows: shares of the height of the reference image between which objects lie (0 = top),
            such as (0.4, 1) for the floor; None = anywhere, as in the paper.
        rotation_degrees: largest turn to either side.
        feather_px: softness of an object's rim, sigma.
        colour_match: share of an object's mean colour that is taken from its surroundings.
        shadow: probability that an object casts a shadow (never part of the mask).
        removal: probability that a change is in the reference: the object is gone from live.
        homography_px: largest move of a corner of the reference.
        flow_px: size of the smooth displacements that alignment leaves over.
        exposure: factor on brightness, either way.
        colour_cast: factor on single colour channels, either way.
        shade: strength of soft light and shadow that only one picture has.
        noise: largest standard deviation of sensor noise, in 8-bit steps.
        blur_px: largest blur of one of the two pictures, sigma.
    """

    changes: tuple[int, int] = (1, 4)
    unchanged: int = 3
    size_px: Range = (6.0, 120.0)
    rows: Range | None = None
    rotation_degrees: float = 180.0
    feather_px: Range = (0.3, 1.0)
    colour_match: Range = (0.0, 0.7)
    shadow: float = 0.6
    removal: float = 0.3
    homography_px: float = 1.5
    flow_px: float = 1.5
    exposure: float = 1.25
    colour_cast: float = 1.06
    shade: float = 0.2
    noise: float = 4.0
    blur_px: float = 0.8

    def __post_init__(self) -> None:
        for name in ("changes", "size_px", "feather_px", "colour_match"):
            low, high = getattr(self, name)
            if not 0 <= low <= high:
                raise InvalidInput(f"synthesis {name}: need 0 <= low <= high, not {low}, {high}")
        for name in ("shadow", "removal", "shade"):
            if not 0 <= getattr(self, name) <= 1:
                raise InvalidInput(
                    f"synthesis {name}: must lie in [0, 1], but is {getattr(self, name)}"
                )
        for name in ("exposure", "colour_cast"):
            if not 1 <= getattr(self, name) <= 4:
                raise InvalidInput(
                    f"synthesis {name}: a factor from 1 to 4, but is {getattr(self, name)}"
                )
        for name in ("unchanged", "homography_px", "flow_px", "noise", "blur_px"):
            if getattr(self, name) < 0:
                raise InvalidInput(f"synthesis {name}: must be >= 0, but is {getattr(self, name)}")
        if self.rows is not None and not 0 <= self.rows[0] < self.rows[1] <= 1:
            raise InvalidInput(f"synthesis rows: need 0 <= top < bottom <= 1, not {self.rows}")
        if self.size_px[0] < 2:
            raise InvalidInput(f"synthesis size_px: objects have 2 pixels, not {self.size_px[0]}")

    def record(self) -> dict[str, Any]:
        """Return the settings as plain JSON values; what is not set is left out."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {
            k: list(v) if isinstance(v, tuple) else v for k, v in values.items() if v is not None
        }
