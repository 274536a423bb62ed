"""A plan as files: Nav2 waypoints (as the Nav2 panel of RViz loads them), CSV, GeoJSON.

Coordinates are metres in the map's frame, also in the GeoJSON, which says so: QGIS and geopandas
show it over the map, a globe does not.
"""

from __future__ import annotations

import csv
import io
import json
import math
from typing import Any

import yaml

from reviewer.inspection.planning import InspectionPlan
from reviewer.texts import as_cell


def nav2_yaml(plan: InspectionPlan) -> str:
    """Return waypoints in order: `pose` x, y, z and `orientation` w, x, y, z."""
    waypoints = {}
    for number, view in enumerate(plan.tour.views):
        half = view.pose.theta / 2
        waypoints[f"waypoint{number}"] = {
            "pose": [round(view.pose.x, 4), round(view.pose.y, 4), 0.0],
            "orientation": [round(math.cos(half), 6), 0.0, 0.0, round(math.sin(half), 6)],
        }
    return str(yaml.safe_dump({"waypoints": waypoints}, sort_keys=False, default_flow_style=None))


COLUMNS = (
    "order", "x", "y", "theta", "target_x", "target_y", "target_z", "doi", "regions", "pairs",
    "labels",
)  # fmt: skip


def plan_rows(plan: InspectionPlan) -> list[dict[str, Any]]:
    """Return one row per view: pose, what it looks at, the regions' ids, pairs, labels; metres."""
    rows = []
    for number, view in enumerate(plan.tour.views, start=1):
        to_inspect = [placed.region for placed in view.target.to_inspect]
        rows.append(
            {
                "order": number,
                "x": round(view.pose.x, 3),
                "y": round(view.pose.y, 3),
                "theta": round(view.pose.theta, 4),
                "target_x": round(view.target.x, 3),
                "target_y": round(view.target.y, 3),
                "target_z": round(sum(view.target.heights) / 2, 3),
                "doi": round(view.target.weight, 3),
                "regions": " ".join(str(region.id) for region in to_inspect),
                "pairs": " ".join(dict.fromkeys(f"{r.split}/{r.pair}" for r in to_inspect)),
                "labels": " ".join(dict.fromkeys(r.labels for r in to_inspect if r.labels)),
            }
        )
    return rows


def plan_csv(plan: InspectionPlan) -> str:
    """Return the rows as CSV."""
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows({k: as_cell(v) for k, v in row.items()} for row in plan_rows(plan))
    return buffer.getvalue()


def plan_geojson(plan: InspectionPlan) -> str:
    """Return views and targets as points, and the tour as a line."""
    features: list[dict[str, Any]] = []

    def point(x: float, y: float, **properties: Any) -> None:
        geometry = {"type": "Point", "coordinates": [round(x, 3), round(y, 3)]}
        features.append({"type": "Feature", "geometry": geometry, "properties": properties})

    for row in plan_rows(plan):
        point(row["x"], row["y"], kind="view", order=row["order"], theta=row["theta"])
        own = {key: row[key] for key in ("order", "doi", "regions", "pairs", "labels")}
        point(row["target_x"], row["target_y"], kind="target", **own)
    for x, y in plan.unseen:
        point(x, y, kind="unseen target")
    if plan.tour.views:
        path = [[round(x, 3), round(y, 3)] for x, y in plan.tour.way]
        features.append(
            {
                "type": "Feature",
                "geometry": {"type": "LineString", "coordinates": path},
                "properties": {"kind": "tour", "length_m": round(plan.tour.length, 2)},
            }
        )
    about = {"frame": "map", "unit": "metre", "split": plan.split}
    return json.dumps({"type": "FeatureCollection", "properties": about, "features": features})


FORMATS = {"yaml": nav2_yaml, "csv": plan_csv, "geojson": plan_geojson}
"""Writers by the ending of a file's name."""
