"""The command line: one function call per command; errors a user can mend end in one line, exit 2.

Heavy libraries are imported inside the commands, so `reviewer --help` answers at once. Each module
here adds its commands; `options.ORDER` says in which order they are listed.
"""

from __future__ import annotations

import sys
from io import TextIOWrapper

import typer

from reviewer.cli import (  # noqa: F401
    audit,
    checkpoints,
    data,
    exporting,
    found,
    machine,
    pipeline,
    planning,
    runs,
    serving,
    synthesis,
    training,
    whatif,
)
from reviewer.cli.options import app
from reviewer.errors import ReviewerError, tell_system_error
from reviewer.extras import telling_what_is_missing

__all__ = ["app", "main"]


def main() -> None:
    """Entry point: turn errors a user can act on into one line and exit code 2."""
    if isinstance(sys.stdout, TextIOWrapper):
        # Names in files may be no text; telling them must not fail for that.
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        with telling_what_is_missing(" ".join(sys.argv[1:2]) or "reviewer"):
            app()
    except (ReviewerError, OSError) as error:
        told = error if isinstance(error, ReviewerError) else tell_system_error(error)
        typer.echo(f"reviewer: {told}", err=True)
        sys.exit(2)
