"""`plan`: where the robot should look again, from where, and in what order."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from reviewer.cli.options import DEFAULT_DB, Database, app, open_store, print_table
from reviewer.errors import Conflict, InvalidInput, NotFound


@app.command()
def plan(
    split: Annotated[str, typer.Argument(help="Split to plan.")],
    run: Annotated[str | None, typer.Option(help="Run; default: the newest.")] = None,
    budget: Annotated[float, typer.Option(help="Longest tour, metres.", min=0)] = 20.0,
    start: Annotated[
        str | None, typer.Option(help="Where the robot is, X,Y metres; default: at the first view.")
    ] = None,
    camera_height: Annotated[
        float, typer.Option(help="Height of the camera above the floor, metres.", min=0.01)
    ] = 0.72,
    pitch: Annotated[
        float, typer.Option(help="Pitch of the camera, radians; < 0 looks down.")
    ] = -0.42,
    focal: Annotated[float, typer.Option(help="Focal length, pixels.", min=1)] = 385.0,
    stand_off: Annotated[float, typer.Option(help="Best distance of a view, metres.")] = 1.0,
    robot_radius: Annotated[float, typer.Option(help="Radius of the robot, metres.", min=0)] = 0.22,
    output: Annotated[
        list[Path] | None,
        typer.Option(help="Write .yaml (Nav2 waypoints), .csv or .geojson; repeatable."),
    ] = None,
    db: Database = DEFAULT_DB,
) -> None:
    """Rank viewpoints by regions that need another look, and plan a short tour of new views."""
    from reviewer.geometry import FloorCamera, Pose2
    from reviewer.inspection.planning import PlanSettings, plan_inspection
    from reviewer.inspection.views import ViewSettings
    from reviewer.inspection.writing import FORMATS, plan_rows
    from reviewer.store.pairs import list_pairs
    from reviewer.store.runs import run_or_newest

    for path in output or []:
        if path.suffix[1:] not in FORMATS:
            raise InvalidInput(f"--output {path}: ends in none of .{', .'.join(FORMATS)}")
        if path.exists():
            raise Conflict(f"{path}: exists already; name a new file")
        if not path.parent.is_dir():
            raise NotFound(f"{path.parent}: is not a folder")
    begin = None
    if start is not None:
        try:
            x, y = (float(part) for part in start.split(","))
            if not (math.isfinite(x) and math.isfinite(y)):
                raise ValueError(start)
        except ValueError as error:
            raise InvalidInput(f"--start {start}: must be X,Y in metres") from error
        begin = Pose2(x, y, 0.0)
    with open_store(db) as store:
        live = list_pairs(store, [split])[0].live
        camera = FloorCamera(camera_height, pitch, focal, live.height, live.width)
        settings = PlanSettings(camera, ViewSettings(robot_radius, stand_off), budget)
        found = plan_inspection(store, run_or_newest(store, run), split, settings, begin)
    ranked = [
        {"viewpoint": each.pair.title, "regions": each.regions, "sum of DoI": each.doi}
        for each in found.ranked
    ]
    print_table(ranked, title="viewpoints by regions that ask for another look")
    shown = ("order", "x", "y", "theta", "target_x", "target_y", "doi", "pairs")
    rows = [{key: row[key] for key in shown} for row in plan_rows(found)]
    print_table(rows, title=f"tour of {found.tour.length:.1f} m, budget {budget:g} m")
    placed = sum(region.place is not None for region in found.to_inspect)
    typer.echo(
        f"{len(found.to_inspect)} regions, {placed} with a place; places that no reachable"
        f" cell sees: {len(found.unseen)}, views beyond the budget: {len(found.tour.left_out)}"
        + (f", lighter ones not looked for: {found.not_looked_for}" * bool(found.not_looked_for))
    )
    for path in output or []:
        path.write_text(FORMATS[path.suffix[1:]](found), encoding="utf-8")
        typer.echo(f"wrote {path}")
