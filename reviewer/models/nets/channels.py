"""Channel numbers of a net that is narrower or wider than its paper's."""

from __future__ import annotations

from reviewer.errors import InvalidInput


def scaled(width: float, *channels: int) -> tuple[int, ...]:
    """Return channel numbers times `width`, in multiples of 8 so that groups and halves divide.

    Raises:
        InvalidInput: when `width` is not in (0, 4].
    """
    if not 0 < width <= 4:
        raise InvalidInput(f"width: must lie in (0, 4], but is {width}")
    return tuple(max(8, 8 * round(number * width / 8)) for number in channels)
