"""`demo`, `serve`, `schema`: the app, with a world of its own or with yours."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from reviewer.cli.data import print_imports
from reviewer.cli.options import DEFAULT_DB, TERMINAL, Database, app, open_store, progress_bar
from reviewer.cli.pipeline import print_run, print_scores
from reviewer.errors import InvalidInput

ClickModel = Annotated[
    str,
    typer.Option(
        help="Click segmenter: click-net, grabcut, sam:PATH, sam2:PATH; PATH: directory or hub id.",
        metavar="NAME[:PATH]",
    ),
]


Token = Annotated[
    str | None,
    typer.Option(
        envvar="REVIEWER_TOKEN",
        help="Sign-in token; default: a new one. Other users of the machine see it in the list of"
        " processes; the variable is hidden from them.",
    ),
]
TokenFile = Annotated[Path | None, typer.Option(help="File that holds the token.", metavar="FILE")]


@app.command()
def demo(
    folder: Annotated[Path, typer.Option("--dir", help="Where the world is kept.")] = Path(
        "demo-data"
    ),
    pairs_per_split: Annotated[
        str, typer.Option(help='Pairs per split, or "paper": 1875 in all.')
    ] = "4",
    seed: Annotated[int, typer.Option(help="Each seed gives another world.")] = 7,
    workers: Annotated[int, typer.Option(help="Processes that render.", min=1)] = 2,
    check: Annotated[
        bool, typer.Option("--check", help="Print the table of scores, and exit.")
    ] = False,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port.")] = 8000,
    token: Token = None,
    token_file: TokenFile = None,
    click: ClickModel = "click-net",
) -> None:
    """Render the demo world, import it, run the weight-free pipeline, and open the app."""
    from reviewer.dataset.settings import ImportSettings
    from reviewer.demo.world import plan_splits, render_world
    from reviewer.flows.importing import import_splits
    from reviewer.flows.running import RunOrder, run_stages
    from reviewer.pipeline.settings import PipelineSettings

    secret = _secret(token, token_file)
    if pairs_per_split != "paper" and not (pairs_per_split.isdigit() and int(pairs_per_split) > 0):
        raise InvalidInput(f'--pairs-per-split: a number or "paper", not {pairs_per_split!r}')
    plans = plan_splits(None if pairs_per_split == "paper" else int(pairs_per_split), seed)
    data = folder / f"world-{seed}-{pairs_per_split}"
    total = sum(plan.pairs for plan in plans)
    with progress_bar("render") as bar:
        done = 0
        for name, pairs in render_world(data, plans, workers=workers):
            done += pairs
            bar(done, total, name)
    with open_store(data / "reviewer.db", create=True) as store:
        print_imports(import_splits(store, data, ImportSettings(), listener=TERMINAL))
        print_run(run_stages(store, RunOrder(PipelineSettings(), workers=workers), TERMINAL))
        print_scores(store, None, "table")
    if not check:
        _serve(data / "reviewer.db", host, port, secret, [], [], click)


@app.command()
def serve(
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port.")] = 8000,
    token: Token = None,
    token_file: TokenFile = None,
    allow_host: Annotated[
        list[str] | None, typer.Option(help="Further host names of this server; repeatable.")
    ] = None,
    proxy: Annotated[
        list[str] | None,
        typer.Option(
            help="Address of a reverse proxy whose X-Forwarded-For and -Proto are trusted;"
            " repeatable."
        ),
    ] = None,
    click: ClickModel = "click-net",
    db: Database = DEFAULT_DB,
) -> None:
    """Open the app on one port and print the link to sign in with."""
    secret = _secret(token, token_file)
    _serve(db, host, port, secret, allow_host or [], proxy or [], click)


@app.command()
def schema() -> None:
    """Print the database schema as Markdown (this is db/README.md)."""
    from reviewer.store.describe import describe_schema

    typer.echo(describe_schema())


def _secret(token: str | None, token_file: Path | None) -> str | None:
    """Return the token that was given, in whatever way; None for none.

    Raises:
        InvalidInput: when it is given twice, or the file cannot be read or holds none.
    """
    if token_file is None:
        return token
    if token is not None:
        raise InvalidInput("--token-file: a token is given by --token or REVIEWER_TOKEN, too")
    try:
        secret = token_file.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidInput(f"--token-file {token_file}: cannot be read, {error}") from error
    if not secret:
        raise InvalidInput(f"--token-file {token_file}: is empty")
    return secret


def _serve(
    db: Path,
    host: str,
    port: int,
    token: str | None,
    allow_host: list[str],
    proxies: list[str],
    click: str,
) -> None:
    from reviewer.app.server import serve_app

    serve_app(
        db,
        host=host,
        port=port,
        token=token,
        allow_hosts=allow_host,
        proxies=proxies,
        click=click,
    )
