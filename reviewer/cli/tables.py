"""What `evaluate` prints beside its plain table: Table A, the matrix, figure E."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from reviewer.cli.options import print_table, progress_bar
from reviewer.words import ScoreTable, TableFormat

if TYPE_CHECKING:
    from reviewer.evaluation.protocols import Protocol
    from reviewer.evaluation.table_a import Row
    from reviewer.store.database import Store
    from reviewer.words import Seen, Standing


def table_rows(
    store: Store,
    run: str | None,
    protocol: Protocol,
    standings: Sequence[Standing],
    repeats: Sequence[str],
    seen: Seen | None,
) -> list[Row]:
    """Return the rows of Table A of all runs, or of one, counted anew where they are not."""
    from reviewer.evaluation.counting import refresh_counts
    from reviewer.evaluation.table_a import read_repeats, table_a_rows
    from reviewer.store.runs import run_of_name
    from reviewer.store.scores import pair_scores

    named = read_repeats(repeats)
    if run is not None:
        run_of_name(store, run)
    refresh_counts(store)
    scores = pair_scores(store, run, standings)
    runs = len({score.run for score in scores})
    with progress_bar("other scopes") as bar:
        done = 0

        def progress(name: str) -> None:
            nonlocal done
            done += 1
            bar(done, runs, name)

        return table_a_rows(store, scores, protocol, repeats=named, seen=seen, progress=progress)


def print_rows(
    store: Store,
    rows: Sequence[Row],
    kind: ScoreTable,
    form: TableFormat,
    title: str,
) -> None:
    """Print Table A, or the matrix of what was trained on and tested on."""
    from reviewer.reports.matrix import matrix_cells, matrix_rows, matrix_text
    from reviewer.reports.table_a_text import columns_of, table_a_cells, table_a_text

    if not rows:
        print_table([], title=title)
    elif kind == "matrix":
        matrix = matrix_rows(store, rows)
        if form == "table":
            print_table(matrix_cells(matrix), title=f"{title}, by what was trained on")
        else:
            typer.echo(matrix_text(matrix, form))
    elif form == "table":
        head = columns_of(rows)
        cells = [dict(zip(head, line, strict=True)) for line in table_a_cells(rows)]
        print_table(cells, title=title)
    else:
        typer.echo(table_a_text(rows, form))


def draw_figure_e(rows: Sequence[Row], path: Path) -> None:
    """Write figure E."""
    from reviewer.reports.split_figure import draw_splits

    draw_splits(rows, path)
    typer.echo(f"wrote {path}", err=True)
