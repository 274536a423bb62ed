"""`synth` and `train`: synthetic pairs of reference images, and detectors fitted to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from reviewer.cli.options import DEFAULT_DB, Database, Splits, app, open_store, progress_bar
from reviewer.errors import InvalidInput

if TYPE_CHECKING:
    from reviewer.store.database import Store
    from reviewer.synthesis.bank import Bank
    from reviewer.synthesis.settings import SynthesisSettings
    from reviewer.training.session import Validated

TrainOnName = Literal["same_split", "same_workspace", "others"]
DetectorName = Literal["cscdnet", "cscdnet-attention", "dr-tanet", "cdnet", "tanet"]
PreprocessingName = Literal["bgr_128", "imagenet"]
PrecisionName = Literal["auto", "float32", "bfloat16"]

TrainOn = Annotated[
    TrainOnName,
    typer.Option(help="Reference images of these splits, of their workspaces, or of the others."),
]
Coco = Annotated[
    Path | None,
    typer.Option(help="COCO instances JSON with the objects to paste; else rendered ones."),
]
CocoImages = Annotated[
    Path | None, typer.Option(help="Folder of its images; else images/ beside the JSON.")
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
Seed = Annotated[int, typer.Option(help="Decides everything random.")]


@app.command()
def synth(
    target: Annotated[Path, typer.Argument(help="New folder: t0/ t1/ mask/ contact-sheet.png")],
    count: Annotated[int, typer.Option(help="How many pairs.", min=1)] = 100,
    crop: Annotated[
        int | None, typer.Option(help="Side of a square cut out; else whole images.", min=64)
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
    from reviewer.synthesis.shelf import Shelf
    from reviewer.training.selection import data_record, select_references

    settings = _synthesis(synthesis)
    with open_store(db) as store:
        references = select_references(store, split or [], train_on)
        bank = _bank(store, coco, images, category, least_area, seed)
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


@app.command()
def train(
    detector: Annotated[DetectorName, typer.Argument(help="Which net.")],
    name: Annotated[str | None, typer.Option(help="Name of the training; else the net's.")] = None,
    split: Annotated[
        list[str] | None,
        typer.Option(
            "--split", "--splits", help="Splits it is for, cs1,cs2 or repeated; else all."
        ),
    ] = None,
    train_on: TrainOn = "same_split",
    width: Annotated[float, typer.Option(help="Factor on channels; 1 is the paper's net.")] = 1.0,
    iterations: Annotated[int | None, typer.Option(help="Else the paper's.", min=1)] = None,
    batch: Annotated[int | None, typer.Option(help="Else the paper's.", min=2)] = None,
    lr: Annotated[float | None, typer.Option(help="Else the paper's.")] = None,
    crop: Annotated[int, typer.Option(help="Side of the training squares, pixels.")] = 256,
    class_weight: Annotated[
        float, typer.Option(help="Weight of changed pixels in the loss; unchanged ones have 1.")
    ] = 1.0,
    backbone_weights: Annotated[
        str, typer.Option(help="ResNet-18 file, torchvision or timm naming; or none.")
    ] = "none",
    preprocessing: Annotated[
        PreprocessingName, typer.Option(help="How pictures become numbers.")
    ] = "bgr_128",
    level: Annotated[
        int | None, typer.Option(help="cscdnet-attention: level of the mask, 2 to 5.")
    ] = None,
    strength: Annotated[
        float | None, typer.Option(help="cscdnet-attention: lambda, 0 to 1.")
    ] = None,
    source: Annotated[
        str | None, typer.Option(help="cscdnet-attention: descriptor-energy, texture-energy.")
    ] = None,
    window: Annotated[int | None, typer.Option(help="tanet: side of its window.")] = None,
    clip_norm: Annotated[float, typer.Option(help="Largest gradient norm; 0 = any.")] = 5.0,
    precision: Annotated[PrecisionName, typer.Option(help="Of the arithmetic.")] = "auto",
    validate_every: Annotated[
        int, typer.Option(help="Iterations between two checkpoints.", min=1)
    ] = 500,
    validation_pairs: Annotated[int, typer.Option(help="Synthetic pairs of each.", min=1)] = 64,
    coco: Coco = None,
    images: CocoImages = None,
    category: Category = None,
    least_area: LeastArea = 400,
    synthesis: Synthesis = None,
    seed: Seed = 0,
    workers: Annotated[
        int, typer.Option(help="Processes that make pairs; 0 = none beside this one.", min=0)
    ] = 0,
    db: Database = DEFAULT_DB,
) -> None:
    """Train a detector on synthetic pairs; the same command again goes on where it was stopped."""
    from reviewer.metrics import f_score
    from reviewer.synthesis.shelf import Shelf
    from reviewer.training.selection import data_record, select_references
    from reviewer.training.session import TrainingData
    from reviewer.training.session import train as fit
    from reviewer.training.settings import TrainingSettings

    splits = [each for text in split or [] for each in text.split(",")]
    given = {"iterations": iterations, "batch": batch, "lr": lr}
    of_net = {"level": level, "strength": strength, "source": source, "window": window}
    settings = TrainingSettings.of_paper(
        detector,
        width=width,
        net_settings={key: value for key, value in of_net.items() if value is not None},
        crop_px=crop,
        class_weights=(1.0, class_weight),
        preprocessing=preprocessing,
        clip_norm=clip_norm,
        precision=precision,
        validate_every=validate_every,
        validation_pairs=validation_pairs,
        seed=seed,
        **{key: value for key, value in given.items() if value is not None},
    )
    pasting = _synthesis(synthesis)
    backbone = None if backbone_weights == "none" else Path(backbone_weights)
    if backbone is None:
        typer.echo("encoders start from random weights (--backbone-weights takes a ResNet-18)")
    with open_store(db) as store:
        references = select_references(store, splits, train_on)
        bank = _bank(store, coco, images, category, least_area, seed)
        title = name or detector
        folder = store.folder / "trainings" / title
        record = {
            **data_record(references, bank, pasting),
            "splits": sorted(splits),
            "train_on": train_on,
        }
        shelf = Shelf([image.path for image in references])
        data = TrainingData(shelf, bank, pasting, record)

        def keep(at: Validated) -> None:
            typer.echo(
                f"iteration {at.iteration}: F {f_score(at.counts):.4f} on synthetic validation,"
                f" best {at.best_f:.4f} at {at.best_iteration}"
            )
            _keep(store, title, folder, settings.record(), pasting.record(), record, at)

        with progress_bar(title) as bar:
            done = fit(
                folder,
                settings,
                data,
                backbone=backbone,
                workers=workers,
                on_step=lambda step: bar(
                    step.iteration,
                    settings.iterations,
                    f"loss {step.loss:.4f}, {step.pairs_per_s:.1f} pairs/s",
                ),
                on_validation=keep,
            )
    typer.echo(
        f"{title}: {done.iteration} iterations; best F on synthetic validation {done.best_f:.4f}"
        f" at iteration {done.best_iteration}"
    )
    typer.echo(f"next: reviewer run --detector {detector}:{folder / 'best.pt'}")


def _keep(
    store: Store,
    name: str,
    folder: Path,
    settings: dict[str, Any],
    pasting: dict[str, Any],
    data: dict[str, Any],
    at: Validated,
) -> None:
    """Bring the store's row of a training up to date."""
    from reviewer.dataset.files import hash_file
    from reviewer.store.trainings import StoredTraining, save_training

    best = folder / "best.pt"
    save_training(
        store,
        StoredTraining(
            name,
            settings["net"],
            best.relative_to(store.folder).as_posix(),
            hash_file(best),
            {"training": settings, "synthesis": pasting, "data": data},
            data["sha256"],
            settings["seed"],
            at.iteration,
            at.best_f,
        ),
    )


def _synthesis(given: Sequence[str] | None) -> SynthesisSettings:
    """Read NAME=VALUE settings; two numbers are separated by a comma."""
    from reviewer.synthesis.settings import SynthesisSettings

    defaults = SynthesisSettings()
    known = [field.name for field in fields(defaults)]
    values: dict[str, Any] = {}
    for text in given or []:
        name, equals, value = text.partition("=")
        if name not in known or not equals:
            raise InvalidInput(f"--synthesis {text}: not NAME=VALUE of {', '.join(known)}")
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
    return SynthesisSettings(**values)


def _bank(
    store: Store,
    coco: Path | None,
    images: Path | None,
    categories: Sequence[str] | None,
    least_area: int,
    seed: int,
) -> Bank:
    """Open the bank of objects to paste, and say what it left out."""
    from reviewer.synthesis.bank import load_bank
    from reviewer.synthesis.demo_bank import open_demo_bank

    if coco is None:
        if images or categories:
            raise InvalidInput("--images and --category: belong to --coco, which is not given")
        with progress_bar("render objects") as bar:
            return open_demo_bank(
                store.folder / "object-bank", lambda done, total: bar(done, total, "")
            )
    folder = images or coco.parent / "images"
    bank = load_bank(coco, folder, categories=categories or [], least_area_px=least_area, seed=seed)
    left_out = "".join(f"; left out: {n} {why}" for why, n in sorted(bank.left_out.items()))
    typer.echo(f"{len(bank.objects)} objects to paste from {coco}{left_out}")
    return bank
