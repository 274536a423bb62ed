"""Wrong tokens: each address has a few free tries, then it waits, twice as long each time.

Only in memory, and an address at a time: who waits keeps nobody else out. Behind a proxy the
address is the person's only where the proxy is named (`serve --proxy`).
"""

from __future__ import annotations

import math
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

FREE = 3
LONGEST_S = 60.0
FORGOTTEN_S = 900.0
MOST_ADDRESSES = 10_000


@dataclass(frozen=True, slots=True)
class _Failures:
    count: int
    last: float


class Attempts:
    """Failed sign-ins by address."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._failures: OrderedDict[str, _Failures] = OrderedDict()

    def wait_s(self, address: str) -> int:
        """Return the seconds until an address may try again; 0 for now."""
        failures = self._known(address)
        if failures is None or failures.count < FREE:
            return 0
        wait = min(2.0 ** (failures.count - FREE), LONGEST_S)
        return max(0, math.ceil(failures.last + wait - self._clock()))

    def fail(self, address: str) -> int:
        """Note a wrong token, and return how many that makes."""
        known = self._known(address)
        count = 1 + (known.count if known else 0)
        self._failures[address] = _Failures(count, self._clock())
        self._failures.move_to_end(address)
        if len(self._failures) > MOST_ADDRESSES:
            self._failures.popitem(last=False)
        return count

    def succeed(self, address: str) -> None:
        """Forget the failures of an address that knew the token."""
        self._failures.pop(address, None)

    def _known(self, address: str) -> _Failures | None:
        failures = self._failures.get(address)
        if failures is not None and self._clock() - failures.last > FORGOTTEN_S:
            del self._failures[address]
            return None
        return failures
