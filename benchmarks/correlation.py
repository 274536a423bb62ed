"""Compare the blocked correlation with 441 shifted products, in time and in memory.

Maps of CSCDNet's first level for a 640x480 pair padded to 640x512: (1, 64, 256, 320). Both run in
this process, in turns; the figures are ratios. `--json` prints one JSON object.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path

import torch
from torch.nn import functional

from reviewer.models.nets.correlation import correlate

SHAPE = (1, 64, 256, 320)
LIMITS = {"speedup_vs_loop": 5.0, "peak_over_output": 2.0}
"""The first is to be exceeded, the second not."""


def by_shifted_products(first: torch.Tensor, second: torch.Tensor) -> torch.Tensor:
    """The definition, one product and one mean for each of the 441 displacements."""
    height, width = first.shape[-2:]
    padded = functional.pad(second, (20, 20, 20, 20))
    volume = first.new_empty(len(first), 441, height, width)
    for number in range(441):
        y, x = 2 * (number // 21), 2 * (number % 21)
        volume[:, number] = (first * padded[..., y : y + height, x : x + width]).mean(1)
    return volume


def memory_kb(field: str) -> int:
    """Return a figure of /proc/self/status in KiB."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(field + ":"):
            return int(line.split()[1])
    raise RuntimeError(f"/proc/self/status has no {field}")


def peak_bytes(work: Callable[[], object]) -> int:
    """Return by how much the process grew while it worked, at most."""
    Path("/proc/self/clear_refs").write_text("5")  # forget the peak so far
    before = memory_kb("VmRSS")
    work()
    return 1024 * (memory_kb("VmHWM") - before)


def seconds(work: Callable[[], object]) -> float:
    """Return how long a call takes."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def measure() -> dict[str, float]:
    """Return all figures."""
    torch.manual_seed(0)
    first, second = torch.randn(2, *SHAPE)
    small = torch.randn(1, 64, 16, 16)
    correlate(small, small)
    with torch.no_grad():
        peak = peak_bytes(lambda: correlate(first, second))
        volume = correlate(first, second)
        error = float((volume - by_shifted_products(first, second)).abs().max())
        turns = [
            (
                seconds(lambda: correlate(first, second)),
                seconds(lambda: by_shifted_products(first, second)),
            )
            for _ in range(5)
        ]
    blocked, loop = min(t[0] for t in turns), min(t[1] for t in turns)
    maps = [first.requires_grad_(), second.requires_grad_()]
    result = correlate(*maps)
    back = seconds(lambda: result.sum().backward())
    return {
        "speedup_vs_loop": loop / blocked,
        "peak_over_output": peak / (volume.numel() * volume.element_size()),
        "blocked_s": blocked,
        "loop_s": loop,
        "backward_s": back,
        "largest_difference": error,
    }


def main() -> None:
    """Print the figures; exit 1 when one misses its limit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    figures = measure()
    if arguments.json:
        print(json.dumps(figures))
    else:
        for name, value in figures.items():
            print(f"{name:20} {value:10.4g}")
    missed = (
        figures["speedup_vs_loop"] < LIMITS["speedup_vs_loop"]
        or figures["peak_over_output"] > LIMITS["peak_over_output"]
    )
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
