"""The model card says what is true of the weights in the package, and of what made them."""

import csv
import re
from pathlib import Path

import pytest

from reviewer.dataset.files import hash_file
from reviewer.models.nets.click_net import ClickNet
from reviewer.models.nets.siamese_lite import SiameseLite
from reviewer.models.nets.small import SHIPPED
from reviewer.training.change_loop import ChangeTraining
from reviewer.training.click_loop import ClickTraining
from reviewer.training.small_session import VIEWS_PX

ROOT = Path(__file__).resolve().parents[2]
CARD = (ROOT / "docs" / "small-nets.md").read_text()


def row(first):
    """The cells of the card's row that begins so."""
    (found,) = re.findall(rf"^\| {re.escape(first)} \|(.*)\|$", CARD, re.MULTILINE)
    return [cell.strip() for cell in found.split("|")]


@pytest.mark.parametrize("name", ["click-net", "siamese-lite"])
def test_the_hashes_are_those_of_the_weights_in_the_package(name):
    path = SHIPPED / f"{name}.safetensors"
    assert row(f"`{path.name}`")[0] == f"`{hash_file(path)}`"


def test_the_weights_in_the_package_are_named_and_are_small():
    files = sorted(SHIPPED.iterdir())
    assert [file.name for file in files] == ["click-net.safetensors", "siamese-lite.safetensors"]
    size = sum(file.stat().st_size for file in files)
    assert f"{size / 1e6:.1f} MB together" in CARD.replace("\n", " ") and size < 10e6


@pytest.mark.parametrize(("title", "net"), [("click net", ClickNet), ("change net", SiameseLite)])
def test_the_numbers_of_parameters_are_those_of_the_nets(title, net):
    count = sum(weight.numel() for weight in net().parameters())
    assert row(title)[2] == f"{count / 1e6:.2f} M"


def test_the_numbers_of_the_recipe_are_those_of_the_code():
    clicks, change = ClickTraining(), ChangeTraining()
    assert row("steps of a batch") == [
        f"{clicks.steps} of {clicks.batch} windows",
        f"{change.steps} of {change.batch} pairs",
    ]
    assert row("side of the views") == [f"{VIEWS_PX[net]} px" for net in ("clicks", "change")]
    rates = [re.search(r"up to ([\d.]+)", cell)[1] for cell in row("optimiser")]
    assert [float(rate) for rate in rates] == [clicks.rate, change.rate]
    kept = [re.search(r"(\.\d+) a step", cell)[1] for cell in row("kept")]
    assert [float(share) for share in kept] == [clicks.averaging, change.averaging]
    assert change.feature_rate == 0  # "which stay"


def test_every_package_of_the_data_stands_there_with_version_and_licence():
    with (ROOT / "weights" / "sources.csv").open(newline="") as file:
        for each in csv.DictReader(file):
            assert row(f"`{each['package']}`")[:2] == [each["version"], each["licence"]]
