"""How far are places off, and do proposed views see? Against the demo world's exact geometry.

    python benchmarks/inspection.py [DATABASE] [--run NAME] [--json]

The world is staged again from its seed; every region that asks for another look is cast as a ray
into the true room, and every proposed view looks back at the true point.
"""

from __future__ import annotations

import argparse
import json
import math
import re
from pathlib import Path

import numpy as np

from reviewer.demo.renderer import Scene
from reviewer.demo.world import SplitPlan, camera_at, stage_split
from reviewer.geometry import image_point
from reviewer.inspection.planning import DEFAULT_CAMERA, PlanSettings, plan_inspection
from reviewer.inspection.regions_to_inspect import PlacedRegion
from reviewer.store.database import Store
from reviewer.store.pairs import list_pairs, list_splits
from reviewer.store.runs import run_or_newest

FLOOR_M = 0.06
HIT_M = 0.05
WORLD = Path("demo-data/world-7-4/reviewer.db")


def true_point(scene: Scene, placed: PlacedRegion) -> np.ndarray:
    """Return what the camera saw in the middle of a region, world x, y, z."""
    x, y, width, height = placed.region.box_xywh
    pixel = (np.array([v], np.float32) for v in (x + width / 2, y + height / 2))
    points, _, _ = scene.pick(camera_at(placed.pose), *pixel)
    return np.asarray(points[0], np.float64)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("database", nargs="?", type=Path, default=WORLD)
    parser.add_argument("--run", default="dis-siamese-lite-object-net-component")
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    seed = int(re.search(r"world-(\d+)", str(given.database.resolve()))[1])
    on_floor, above, seen, framed, regions_in_all, placed = [], [], [], [], 0, 0
    with Store(given.database) as store:
        run = run_or_newest(store, given.run)
        for split in list_splits(store):
            plan = plan_inspection(store, run, split.name, PlanSettings(budget=math.inf))
            pairs = len(list_pairs(store, [split.name]))
            stage, _ = stage_split(SplitPlan(split.name, pairs, seed))
            scene = stage.live_scene()
            regions_in_all += len(plan.to_inspect)
            for placed in plan.to_inspect:
                if placed.place is None:
                    continue
                placed += 1
                truth = true_point(scene, placed)
                error = math.dist(placed.place[:2], truth[:2])
                (on_floor if truth[2] < FLOOR_M else above).append(error)
            for view in plan.tour.views:
                for placed in view.target.to_inspect:
                    truth = true_point(scene, placed)
                    pixel = image_point(DEFAULT_CAMERA, view.pose, tuple(truth))
                    inside = pixel is not None and 0 <= pixel[0] < 640 and 0 <= pixel[1] < 480
                    framed.append(inside)
                    if not inside:
                        seen.append((truth[2] < FLOOR_M, False))
                        continue
                    at = (np.array([v], np.float32) for v in pixel)
                    hits, _, _ = scene.pick(camera_at(view.pose), *at)
                    clear = float(np.linalg.norm(hits[0] - truth)) < HIT_M
                    seen.append((truth[2] < FLOOR_M, clear))
    flat = [clear for low, clear in seen if low]
    figures = {
        "regions": regions_in_all,
        "with_a_place": placed,
        "on_the_floor": len(on_floor),
        "floor_error_m_median": float(np.median(on_floor)) if on_floor else None,
        "floor_error_m_p90": float(np.quantile(on_floor, 0.9)) if on_floor else None,
        "above_the_floor": len(above),
        "above_error_m_median": float(np.median(above)) if above else None,
        "looked_at": len(seen),
        "in_the_picture": float(np.mean(framed)) if framed else None,
        "really_seen": float(np.mean([clear for _, clear in seen])) if seen else None,
        "really_seen_on_the_floor": float(np.mean(flat)) if flat else None,
    }
    if given.json:
        print(json.dumps(figures, indent=1))
        return
    for name, value in figures.items():
        print(f"{name:28} {value if isinstance(value, int) or value is None else f'{value:.3f}'}")


if __name__ == "__main__":
    main()
