"""Order views into a short tour: which of them fit a budget of metres, and in what order.

The orienteering problem by insertion (the view with the most DoI a metre of detour comes next,
where it costs least) and 2-opt; ways go around obstacles, over the cells on which the robot fits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from skimage.graph import MCP_Geometric

from reviewer.geometry import Pose2, cell_centre
from reviewer.inspection.views import Terrain, View

Ways = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Tour:
    """Views in an order.

    Attributes:
        length: of the way from the start, metres.
        way: points (x, y) of it, metres; around obstacles.
        left_out: views that did not fit the budget.
    """

    views: tuple[View, ...]
    length: float
    way: tuple[tuple[float, float], ...]
    left_out: tuple[View, ...]


def plan_tour(terrain: Terrain, start: Pose2, views: Sequence[View], budget: float) -> Tour:
    """Return the tour from `start` over as much DoI as `budget` metres allow; it ends anywhere."""
    ways = _ways(terrain, [start, *(view.pose for view in views)])
    order: list[int] = []
    left = set(range(1, len(views) + 1))
    while True:
        best: tuple[float, int, list[int]] | None = None
        here = _length(ways, order)
        for k in left:
            tried = min(
                ([*order[:at], k, *order[at:]] for at in range(len(order) + 1)),
                key=lambda path: _length(ways, path),
            )
            length = _length(ways, tried)
            worth = views[k - 1].target.weight / max(length - here, 0.1)
            if length <= budget and (best is None or worth > best[0]):
                best = worth, k, tried
        if best is None:
            break
        left.discard(best[1])
        order = _untangled(ways, best[2])
    chosen = [views[k - 1] for k in order]
    return Tour(
        tuple(chosen),
        _length(ways, order),
        _way(terrain, [start, *(view.pose for view in chosen)]),
        tuple(views[k - 1] for k in sorted(left)),
    )


def _ways(terrain: Terrain, poses: Sequence[Pose2]) -> Ways:
    """Return the lengths of the ways between poses, metres."""
    cells = [terrain.nearest_cell(pose, terrain.standing) for pose in poses]
    table = np.zeros((len(cells), len(cells)))
    for row, cell in enumerate(cells[:-1]):
        found, _ = _search(terrain).find_costs([cell])
        for column in range(row + 1, len(cells)):
            table[row, column] = table[column, row] = found[cells[column]]
    return table * terrain.grid.resolution


def _way(terrain: Terrain, stops: Sequence[Pose2]) -> tuple[tuple[float, float], ...]:
    """Return the points of the shortest way over some stops, every fourth cell and the stops."""
    cells = [terrain.nearest_cell(stop, terrain.standing) for stop in stops]
    points = [(stops[0].x, stops[0].y)]
    for (begin, end), stop in zip(pairwise(cells), stops[1:], strict=True):
        search = _search(terrain)
        search.find_costs([begin], [end])
        path = search.traceback(end)
        points += [cell_centre(terrain.grid, *cell) for cell in path[4:-2:4]]
        points.append((stop.x, stop.y))
    return tuple(points)


def _search(terrain: Terrain) -> MCP_Geometric:
    return MCP_Geometric(np.where(terrain.standing, 1.0, -1.0), fully_connected=True)


def _length(ways: Ways, order: Sequence[int]) -> float:
    stops = [0, *order]
    return float(sum(ways[a, b] for a, b in pairwise(stops)))


def _untangled(ways: Ways, order: list[int]) -> list[int]:
    """Turn parts of the way around as long as that makes it shorter (2-opt)."""
    better = True
    while better:
        better = False
        for i in range(len(order) - 1):
            for j in range(i + 2, len(order) + 1):
                turned = [*order[:i], *reversed(order[i:j]), *order[j:]]
                if _length(ways, turned) < _length(ways, order) - 1e-9:
                    order, better = turned, True
    return order
