"""`synth`: synthetic pairs of reference images; and the options that `train` shares with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from reviewer.cli.options import DEFAULT_DB, Database, Splits, app, open_store, progress_bar
from reviewer.errors import InvalidInput
from reviewer.words import TrainedOn

if TYPE_CHECKING:
    from reviewer.synthesis.bank import Bank


TrainOn = Annotated[
    TrainedOn,
    typer.Option(help="Reference images of these splits, of their workspaces, or of the others."),
]
Coco = Annotated[
    Path | None,
    typer.Option(help="COCO instances JSON with the objects to paste; default: rendered objects."),
]
CocoImages = Annotated[
    Path | None, typer.Option(help="Folder of its images; default: images/ beside the JSON.")
]
Category = Annotated[
    list[str] | None, typer.Option(help="Only objects of this category; repeatable.")
]
LeastArea = Annotated[int, typer.Option(help="Leave out objects with fewer pixels.", min=1)]
Synthesis = Annotated[
    list[str] | None,
    typer.Option(
        "--synthesis",
        metavar="NAME=VALUE",
        help="A setting of synthesis, such as removal=0 or size_px=8,80; repeatable.",
    ),
]
Seed = Annotated[int, typer.Option(help="Seed of all random choices.")]


@app.command()
def synth(
    target: Annotated[Path, typer.Argument(help="New folder: t0/ t1/ mask/ contact-sheet.png")],
    count: Annotated[int, typer.Option(help="How many pairs.", min=1)] = 100,
    crop: Annotated[
        int | None, typer.Option(help="Side of a square crop; default: whole images.", min=64)
    ] = None,
    split: Splits = None,
    train_on: TrainOn = "same_split",
    coco: Coco = None,
    images: CocoImages = None,
    category: Category = None,
    least_area: LeastArea = 400,
    synthesis: Synthesis = None,
    seed: Seed = 0,
    db: Database = DEFAULT_DB,
) -> None:
    """Write synthetic pairs of reference images as a t0t1 folder, with a contact sheet."""
    from reviewer.synthesis.folder import write_folder
    from reviewer.synthesis.pairs import TRAINING, numbered_pair
    from reviewer.synthesis.settings import SynthesisSettings
    from reviewer.synthesis.shelf import Shelf
    from reviewer.training.selection import data_record, select_references

    settings = SynthesisSettings(**read_synthesis(synthesis))
    with open_store(db) as store:
        references = select_references(store, split or [], train_on)
        bank = open_bank(store.folder, coco, images, category, least_area, seed)
    shelf = Shelf([image.path for image in references])
    record = {
        "synthesis": settings.record(),
        "data": data_record(references, bank, settings),
        "seed": seed,
    }
    with progress_bar("synth") as bar:
        write_folder(
            target,
            count,
            lambda number: numbered_pair(
                shelf, bank, settings, seed=seed, stream=TRAINING, number=number, side=crop
            ),
            record,
            lambda done, total: bar(done, total, ""),
        )
    typer.echo(f"{count} pairs in {target}; look at {target / 'contact-sheet.png'}")


def read_synthesis(given: Sequence[str] | None) -> dict[str, Any]:
    """Read NAME=VALUE settings; two numbers are separated by a comma."""
    from reviewer.synthesis.settings import SynthesisSettings

    defaults = SynthesisSettings()
    known = [field.name for field in fields(defaults)]
    values: dict[str, Any] = {}
    for text in given or []:
        name, equals, value = text.partition("=")
        if name not in known or not equals:
            raise InvalidInput(
                f"--synthesis {text}: not NAME=VALUE of {', '.join(known)} (docs/settings.md)"
            )
        default = (0.0, 1.0) if name == "rows" else getattr(defaults, name)
        kind = type(default[0]) if isinstance(default, tuple) else type(default)
        try:
            numbers = [kind(part) for part in value.split(",")]
        except ValueError as error:
            raise InvalidInput(f"--synthesis {text}: {value!r} is no {kind.__name__}") from error
        wanted = len(default) if isinstance(default, tuple) else 1
        if len(numbers) != wanted:
            raise InvalidInput(f"--synthesis {text}: {name} is {wanted} numbers with a comma")
        values[name] = tuple(numbers) if isinstance(default, tuple) else numbers[0]
    return values


def open_bank(
    place: Path,
    coco: Path | None,
    images: Path | None,
    categories: Sequence[str] | None,
    least_area: int,
    seed: int,
) -> Bank:
    """Open the bank of objects to paste, and say what it left out.

    Args:
        place: folder of the database; rendered objects are kept there.
    """
    from reviewer.synthesis.bank import load_bank
    from reviewer.synthesis.demo_bank import open_demo_bank

    if coco is None:
        if images or categories:
            raise InvalidInput("--images and --category: belong to --coco, which is not given")
        with progress_bar("render objects") as bar:
            return open_demo_bank(place / "object-bank", lambda done, total: bar(done, total, ""))
    folder = images or coco.parent / "images"
    bank = load_bank(coco, folder, categories=categories or [], least_area_px=least_area, seed=seed)
    left_out = "".join(f"; left out: {n} {why}" for why, n in sorted(bank.left_out.items()))
    typer.echo(f"{len(bank.objects)} objects to paste from {coco}{left_out}")
    return bank
