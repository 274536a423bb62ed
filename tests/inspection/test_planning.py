"""A plan of a stored split: what it ranks, what it writes, and what it refuses."""

import csv
import io
import json
import math

import pytest
import yaml
from typer.testing import CliRunner

from reviewer.cli import app
from reviewer.errors import InvalidInput, NotFound
from reviewer.geometry import FloorCamera
from reviewer.inspection.planning import PlanSettings, plan_inspection
from reviewer.inspection.views import ViewSettings
from reviewer.inspection.writing import nav2_yaml, plan_csv, plan_geojson, plan_rows
from reviewer.store.regions_to_inspect import inspect_regions

CAMERA = FloorCamera(0.7, -0.45, 100.0, 120, 160)
SETTINGS = PlanSettings(CAMERA, ViewSettings(robot_radius=0.1), 30.0)


@pytest.fixture
def doubtful(db, run):
    """A run whose regions all ask for another look."""
    db.write(lambda c: c.execute("UPDATE regions SET inspect = 1, doi = 0.95"))
    return run


def test_viewpoints_are_ranked_and_views_face_their_targets(db, doubtful):
    plan = plan_inspection(db, doubtful, "cs1", SETTINGS)
    assert [each.pair.title for each in plan.ranked] == ["cs1/0000", "cs1/0001"]
    assert len(plan.to_inspect) == len(inspect_regions(db, doubtful.id)) == 2
    for view in plan.tour.views:
        dx, dy = view.target.x - view.pose.x, view.target.y - view.pose.y
        assert math.atan2(dy, dx) == pytest.approx(view.pose.theta)
    assert plan.tour.views and plan.tour.length <= 30


def test_what_somebody_judged_needs_no_other_look(db, doubtful):
    from reviewer.editing.verdicts import give_verdict
    from reviewer.store.reviews import annotator_id

    first = inspect_regions(db, doubtful.id)[0]
    give_verdict(db, first.id, annotator_id(db, "Ada"), "reject")
    assert first.id not in {region.id for region in inspect_regions(db, doubtful.id)}


def test_a_label_is_no_formula_in_csv(db, doubtful, monkeypatch):
    plan = plan_inspection(db, doubtful, "cs1", SETTINGS)
    rows = [{**row, "labels": "=1+1"} for row in plan_rows(plan)]
    monkeypatch.setattr("reviewer.inspection.writing.plan_rows", lambda _: rows)
    written = list(csv.DictReader(io.StringIO(plan_csv(plan))))
    assert {row["labels"] for row in written} == {"'=1+1"}
    assert [float(row["x"]) for row in written] == [row["x"] for row in rows]


def test_the_files_say_the_same(db, doubtful):
    plan = plan_inspection(db, doubtful, "cs1", SETTINGS)
    waypoints = yaml.safe_load(nav2_yaml(plan))["waypoints"]
    rows = list(csv.DictReader(io.StringIO(plan_csv(plan))))
    assert list(waypoints) == [f"waypoint{k}" for k in range(len(plan.tour.views))]
    for waypoint, row, view in zip(waypoints.values(), rows, plan.tour.views, strict=True):
        w, x, y, z = waypoint["orientation"]
        theta = 2 * math.atan2(z, w)
        assert (x, y) == (0, 0) and theta == pytest.approx(view.pose.theta, abs=1e-5)
        assert waypoint["pose"][:2] == pytest.approx([view.pose.x, view.pose.y], abs=1e-3)
        assert float(row["x"]) == pytest.approx(view.pose.x, abs=1e-3)
        assert row["pairs"].startswith("cs1/")
    found = json.loads(plan_geojson(plan))
    assert found["type"] == "FeatureCollection" and found["properties"]["frame"] == "map"
    kinds = [feature["properties"]["kind"] for feature in found["features"]]
    assert kinds.count("view") == kinds.count("target") == len(rows) and kinds[-1] == "tour"
    path = found["features"][-1]["geometry"]["coordinates"]
    assert path[0] == pytest.approx([plan.start.x, plan.start.y], abs=1e-3)
    assert path[-1] == pytest.approx([float(rows[-1]["x"]), float(rows[-1]["y"])])


def test_a_split_without_map_or_of_another_size_is_refused(db, doubtful):
    with pytest.raises(InvalidInput, match="is 160x120, but the camera takes 640x480"):
        plan_inspection(db, doubtful, "cs1", PlanSettings())
    wide = PlanSettings(CAMERA, ViewSettings(robot_radius=9.0))
    with pytest.raises(InvalidInput, match="a robot of radius 9 m fits nowhere"):
        plan_inspection(db, doubtful, "cs1", wide)
    db.write(lambda c: c.execute("UPDATE splits SET map_id = NULL"))
    with pytest.raises(NotFound, match="split cs1: has no occupancy map"):
        plan_inspection(db, doubtful, "cs1", SETTINGS)
    db.write(lambda c: c.execute("UPDATE images SET x = NULL, y = NULL, theta = NULL"))
    with pytest.raises(InvalidInput, match="its images have no poses"):
        plan_inspection(db, doubtful, "cs1", SETTINGS)


def test_the_command_writes_three_formats_and_no_fourth(db, doubtful, tmp_path):
    outputs = [str(tmp_path / f"plan.{end}") for end in ("yaml", "csv", "geojson")]
    command = ["plan", "cs1", "--focal", "100", "--camera-height", "0.7", "--robot-radius", "0.1"]
    command += ["--db", str(db.path)]
    options = [part for path in outputs for part in ("--output", path)]
    done = CliRunner().invoke(app, [*command, *options], catch_exceptions=False)
    assert "viewpoints by regions" in done.output and "2 regions, 2 with a place" in done.output
    assert all((tmp_path / f"plan.{end}").stat().st_size for end in ("yaml", "csv", "geojson"))
    again = CliRunner().invoke(app, [*command, *options])
    assert "exists already" in str(again.exception)
    wrong = CliRunner().invoke(app, [*command, "--output", str(tmp_path / "plan.kml")])
    assert "ends in none of .yaml, .csv, .geojson" in str(wrong.exception)
    odd = CliRunner().invoke(app, [*command, "--start", "here"])
    assert "--start here: must be X,Y in metres" in str(odd.exception)
