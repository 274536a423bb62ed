"""`train clicks` and `train change`: the small nets, anew."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import typer

from reviewer.cli.options import TERMINAL, open_store
from reviewer.cli.synthesis import open_bank
from reviewer.cli.train_options import TrainOptions
from reviewer.errors import InvalidInput
from reviewer.words import SmallNet

TAKEN = frozenset(
    "net name start split train_on backgrounds iterations batch lr backbone_weights coco images"
    " category least_area seed db".split()
)
"""What of the options is about a small net; the rest is about detectors."""
NEXT = {
    "clicks": "reviewer serve --click click-net:{0}; reviewer run --segmenter object-net:{0}",
    "change": "reviewer run --detector siamese-lite:{0}",
}


def train_small(given: TrainOptions, net: SmallNet) -> None:
    """Train a small net in its folder, and say what may be done with it."""
    from reviewer.flows.small_training import photographs, reference_images, train_small_net
    from reviewer.models.nets.small import small_weights
    from reviewer.store.runs import clean_run_name
    from reviewer.training.small_session import SETTINGS, WEIGHTS

    _check(given, net)
    title = clean_run_name(given.name or net)
    place = given.db.resolve().parent
    if given.backgrounds:
        backgrounds = photographs(given.backgrounds)
    else:
        with open_store(given.db) as store:
            splits = [each for text in given.split or [] for each in text.split(",")]
            backgrounds = reference_images(store, splits, given.train_on)
    numbers: dict[str, Any] = {"steps": given.iterations, "batch": given.batch, "rate": given.lr}
    path = train_small_net(
        place / "trainings" / title,
        net,
        SETTINGS[net](seed=given.seed, **{k: v for k, v in numbers.items() if v is not None}),
        backgrounds,
        open_bank(place, given.coco, given.images, given.category, given.least_area, given.seed),
        start=small_weights(WEIGHTS[net]) if given.start == Path("shipped") else given.start,
        backbone=None if given.backbone_weights == "none" else Path(given.backbone_weights),
        listener=TERMINAL,
    )
    typer.echo(f"next: {NEXT[net].format(path)}")


def _check(given: TrainOptions, net: SmallNet) -> None:
    changed = {f.name for f in fields(given) if getattr(given, f.name) != f.default}
    refused = {name: f"is about detectors, not about {net}" for name in changed - TAKEN}
    if given.backgrounds:
        instead = "is about reference images, which --backgrounds replaces"
        refused |= {name: instead for name in changed & {"split", "train_on"}}
    if "backbone_weights" in changed and (net == "clicks" or given.start):
        refused["backbone_weights"] = (
            "clicks has no backbone" if net == "clicks" else "--start brings features of its own"
        )
    for name, why in sorted(refused.items()):
        raise InvalidInput(f"--{name.replace('_', '-')}: {why}")
