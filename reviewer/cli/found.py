"""`found`: the lost-and-found list of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from reviewer.cli.options import DEFAULT_DB, Database, app, open_store, print_table
from reviewer.words import FoundFormat


@app.command()
def found(
    search: Annotated[list[str] | None, typer.Argument(help="Words that must all occur.")] = None,
    run: Annotated[str | None, typer.Option(help="Run; default: the newest.")] = None,
    every: Annotated[
        bool, typer.Option("--every", help="Also list changes without an object.")
    ] = False,
    format: Annotated[FoundFormat, typer.Option(help="Output format.")] = "table",
    output: Annotated[
        Path | None, typer.Option(help="File to write; default: the terminal.")
    ] = None,
    db: Database = DEFAULT_DB,
) -> None:
    """List what was found: name, pair, place, time, DoI, verdict."""
    from reviewer.evaluation.tables import csv_text
    from reviewer.found.listing import list_named_finds
    from reviewer.found.page import found_page
    from reviewer.store.runs import run_or_newest

    with open_store(db) as store:
        chosen = run_or_newest(store, run)
        items = list_named_finds(store, chosen.id, " ".join(search or []), kept=every)
        page = found_page(store, chosen.name, items) if format == "html" else ""
    rows = [item.row() for item in items]
    if format == "html":
        _write(page, output)
    elif format == "csv":
        columns = ("name", "pair", "seen from", "when", "DoI", "verdict")
        _write(csv_text(rows, columns) + "\n", output)
    else:
        print_table(rows, title=f"found by run {chosen.name}")
    if output and format != "table":
        typer.echo(f"{len(rows)} things in {output}")


def _write(text: str, output: Path | None) -> None:
    if output is None:
        typer.echo(text, nl=False)
    else:
        output.write_text(text, encoding="utf-8")
