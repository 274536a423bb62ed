"""The application object, and what several commands share: options, the store, progress bars."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from reviewer.errors import NotFound

if TYPE_CHECKING:
    from reviewer.store.database import Store

ORDER = (
    "demo serve import import-masks import-layer run runs evaluate whatif audit found plan export"
    " synth train checkpoint models doctor schema"
).split()
"""Commands as a newcomer meets them."""


class InOrder(TyperGroup):
    """Lists commands in `ORDER`; one that is not named there comes last."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of the commands."""
        known = super().list_commands(ctx)
        return sorted(known, key=lambda name: ORDER.index(name) if name in ORDER else len(ORDER))


app = typer.Typer(
    cls=InOrder,
    name="reviewer",
    help="Build, review and audit change-detection ground truth on reference/live image pairs.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

Database = Annotated[
    Path, typer.Option("--db", envvar="REVIEWER_DB", help="SQLite database.", show_default=True)
]
Splits = Annotated[list[str] | None, typer.Option("--split", help="Only these splits; repeatable.")]
DEFAULT_DB = Path("reviewer.db")
LOG_EVERY_S = 60.0


def open_store(path: Path, *, create: bool = False) -> Store:
    """Open the database a command works on."""
    from reviewer.store.database import Store

    return Store(path, create=create)


def require_pairs(store: Store) -> None:
    """Refuse what works on pairs where there are none.

    Raises:
        NotFound: when the database holds no pairs; says what brings them in.
    """
    from reviewer.store.pairs import pair_ids

    if not pair_ids(store):
        raise NotFound(
            f"database {store.path}: holds no pairs; bring some in with: reviewer import DIR"
            " (or look around first: reviewer demo)"
        )


@contextmanager
def progress_bar(title: str) -> Iterator[Any]:
    """A progress bar on the terminal: call it with (done, total, what).

    Where there is no terminal (a log, a job's output) it writes a line a minute instead.
    """
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    if not sys.stderr.isatty():
        yield _minute_lines(title)
        return
    columns = (
        TextColumn(f"{title} {{task.description}}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, transient=True, console=Console(stderr=True)) as progress:
        task = progress.add_task("", total=None)

        def advance(done: int, total: int, what: str) -> None:
            progress.update(task, completed=done, total=total, description=what)

        yield advance


def _minute_lines(title: str) -> Callable[[int, int | None, str], None]:
    began = last = time.monotonic()

    def advance(done: int, total: int | None, what: str) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last < LOG_EVERY_S or not done:
            return
        last = now
        left = f", {(total - done) * (now - began) / done / 60:.0f} min left" if total else ""
        typer.echo(f"{title}: {done} of {total or '?'}, {what}{left}", err=True)

    return advance


def print_table(rows: Sequence[Mapping[str, Any]], title: str = "", sections: str = "") -> None:
    """Print rows of the same columns; numbers to the right, scores with four digits.

    Args:
        sections: a value that ends a section, and stands out.
    """
    from rich.console import Console
    from rich.table import Table

    if not rows:
        typer.echo(f"{title}: none" if title else "none")
        return
    table = Table(title=title or None, title_justify="left")
    for column in rows[0]:
        numbers = all(isinstance(row[column], int | float | None) for row in rows)
        table.add_column(column, justify="right" if numbers else "left", overflow="fold")
    for row in rows:
        last = bool(sections) and sections in row.values()
        cells = [_cell(value) for value in row.values()]
        table.add_row(*cells, style="bold" if last else None, end_section=last)
    console = Console()
    # A pipe has no width of its own: nothing is cut or broken there.
    Console(width=console.width if console.is_terminal else 200).print(table)


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.4f}" if isinstance(value, float) else str(value)
