"""Reference images to train on: of the right splits, each once, never a live one."""

import pytest
from scenes import write_split

from reviewer.dataset.importer import ImportSettings, import_split
from reviewer.errors import InvalidInput, NotFound
from reviewer.store.pairs import list_pairs
from reviewer.store.trainings import StoredTraining, list_trainings, save_training
from reviewer.synthesis.bank import Bank
from reviewer.synthesis.settings import SynthesisSettings
from reviewer.training.selection import data_record, select_references


@pytest.fixture
def world(db, tmp_path):
    """Two workspaces, three splits, and one whose name tells nothing."""
    for name in ("cs1", "cs2", "lr1", "kitchen"):
        write_split(tmp_path / name, pairs=2)
        import_split(db, name, tmp_path / name, ImportSettings(), lambda *_: None)
    return db


def splits(world, *arguments):
    return sorted({i.path.parent.parent.name for i in select_references(world, *arguments)})


def test_each_way_takes_its_splits(world):
    assert splits(world, ["cs1"], "same_split") == ["cs1"]
    assert splits(world, ["cs1"], "same_workspace") == ["cs1", "cs2"]
    assert splits(world, ["cs1"], "others") == ["lr1"]
    assert splits(world, [], "same_split") == ["cs1", "cs2", "kitchen", "lr1"]


def test_only_reference_images_are_taken_and_each_once(world):
    images = select_references(world, ["cs1"], "same_split")
    assert {image.path.parent.name for image in images} == {"reference"}
    wanted = {pair.reference.id for pair in list_pairs(world, ["cs1"])}
    assert sorted(image.id for image in images) == sorted(wanted)


def test_what_cannot_be_chosen_is_told(world, db):
    with pytest.raises(NotFound, match="split cs9: does not exist"):
        select_references(world, ["cs9"], "same_split")
    with pytest.raises(InvalidInput, match="split kitchen: its name tells no workspace"):
        select_references(world, ["kitchen"], "others")
    with pytest.raises(InvalidInput, match="no split is left beside cs1, lr1"):
        select_references(world, ["cs1", "lr1"], "others")


def test_an_empty_database_is_told(db):
    with pytest.raises(InvalidInput, match="no split is left"):
        select_references(db, [], "same_split")


def test_the_data_hash_stands_for_images_objects_and_settings(world):
    images, bank = select_references(world, [], "same_split"), Bank((), {}, "b")
    first = data_record(images, bank, SynthesisSettings())
    assert first["references"] == 8 and first["bank_sha256"] == "b"
    assert first == data_record(images[::-1], bank, SynthesisSettings())
    others = [
        data_record(images[1:], bank, SynthesisSettings()),
        data_record(images, Bank((), {}, "c"), SynthesisSettings()),
        data_record(images, bank, SynthesisSettings(noise=0.0)),
    ]
    assert len({first["sha256"], *(other["sha256"] for other in others)}) == 4


def test_a_training_is_kept_once_and_brought_up_to_date(db):
    def at(iteration, f):
        return StoredTraining("a", "cdnet", "a/best.pt", "h", {"x": 1}, "d", 3, iteration, f)

    save_training(db, at(10, 0.2))
    save_training(db, at(20, 0.4))
    assert list_trainings(db) == [at(20, 0.4)]
