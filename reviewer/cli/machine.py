"""`models list | fetch` and `doctor`: weights, and whether everything is as it should be."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Annotated

import typer

from reviewer.cli.options import DEFAULT_DB, Database, app, print_table, progress_bar

models_app = typer.Typer(
    help="List and fetch the weights of models.", no_args_is_help=True, rich_markup_mode=None
)
app.add_typer(models_app, name="models")
SIGN = {"good": "✓", "note": "·", "bad": "✗"}


@models_app.command("list")
def list_models(
    as_json: Annotated[bool, typer.Option("--json", help="Write JSON.")] = False,
) -> None:
    """List weights by name, with source, licence, and whether they are on this machine."""
    from reviewer.models.weights.fetching import find_fetched
    from reviewer.models.weights.presets import PRESETS

    rows = [
        {
            "name": preset.name,
            "here": "yes" if find_fetched(preset) else "no",
            "licence": preset.licence,
            "source": preset.source,
            "use": preset.use,
            "note": preset.note,
        }
        for preset in PRESETS
    ]
    if as_json:
        typer.echo(json.dumps(rows, indent=1))
        return
    print_table([{key: row[key] for key in ("name", "here", "licence", "use")} for row in rows])
    for row in rows:
        if row["note"]:
            typer.echo(f"{row['name']}: {row['note']}")


@models_app.command("fetch")
def fetch_model(
    name: Annotated[str, typer.Argument(help="A name of `models list`, or OWNER/NAME of the hub.")],
) -> None:
    """Download weights, and check them; an interrupted download resumes."""
    from reviewer.models.weights.fetching import fetch
    from reviewer.models.weights.presets import preset_of_name

    preset = preset_of_name(name)
    typer.echo(f"{preset.name}: from {preset.source}, licence: {preset.licence}")
    with progress_bar(preset.name) as bar:
        found = fetch(preset, lambda done, total, file: bar(done, total or None, file))
    typer.echo(f"{preset.name}: {found.size / 2**20:.1f} MiB, checked, in {found.path}")
    typer.echo(f"licence: {found.licence}")
    if preset.use:
        typer.echo(f"use: {preset.use}")


@app.command()
def doctor(
    deep: Annotated[
        bool, typer.Option("--deep", help="Read every image, and compare hashes.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Write JSON.")] = False,
    db: Database = DEFAULT_DB,
) -> None:
    """Check machine, weights, database, images and disk; exit code 1 when something is broken."""
    from reviewer.doctor import check_all

    checks = list(check_all(db, deep=deep))
    if as_json:
        typer.echo(json.dumps([asdict(check) for check in checks], indent=1))
    else:
        for check in checks:
            typer.echo(f"{SIGN[check.finding]} {check.subject}: {check.found}")
    if any(check.finding == "bad" for check in checks):
        raise typer.Exit(1)
