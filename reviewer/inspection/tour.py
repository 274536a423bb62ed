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
LEAST_DETOUR = 0.1
"""Metres: a view on the way is not worth infinitely much."""


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
    """Return the tour from `start` that covers the most DoI within `budget` metres; open-ended."""
    ways = _ways(terrain, [start, *(view.pose for view in views)])
    weights = np.array([0.0, *(view.target.weight for view in views)])
    order: list[int] = []
    left = list(range(1, len(views) + 1))
    while left:
        places, detours = _insertions(ways, order, left)
        fits = _length(ways, order) + detours <= budget
        if not fits.any():
            break
        worth = np.where(fits, weights[left] / np.maximum(detours, LEAST_DETOUR), -1.0)
        best = int(worth.argmax())
        order.insert(int(places[best]), left.pop(best))
        order = _untangled(ways, order)
    chosen = [views[k - 1] for k in order]
    return Tour(
        tuple(chosen),
        _length(ways, order),
        _way(terrain, [start, *(view.pose for view in chosen)]),
        tuple(views[k - 1] for k in sorted(left)),
    )


def _insertions(
    ways: Ways, order: Sequence[int], candidates: Sequence[int]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """Return where each candidate costs least to insert, and how many metres it costs there."""
    stops, wanted = np.array([0, *order]), np.array(candidates)
    costs = ways[np.ix_(stops, wanted)]
    after = stops[1:]
    # Between two stops; the last place is behind them all.
    costs[:-1] += ways[np.ix_(after, wanted)] - ways[stops[:-1], after][:, None]
    places = costs.argmin(axis=0)
    return places, costs[places, np.arange(len(wanted))]


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
    stops = np.array([0, *order])
    better = True
    while better:
        better = False
        for i in range(1, len(stops) - 1):
            # Turning stops[i..j] changes the way into i and the way out of j (none at the end).
            ends = np.arange(i + 1, len(stops))
            gain = ways[stops[i - 1], stops[i]] - ways[stops[i - 1], stops[ends]]
            inner = ends[:-1]
            gain[:-1] += ways[stops[inner], stops[inner + 1]] - ways[stops[i], stops[inner + 1]]
            best = int(gain.argmax())
            if gain[best] > 1e-9:
                j = int(ends[best])
                stops[i : j + 1] = stops[i : j + 1][::-1].copy()
                better = True
    return [int(stop) for stop in stops[1:]]
