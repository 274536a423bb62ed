"""Detectors fitted to ground truth: no pair is judged by a net that has seen it."""

import json

import pytest
import torch
from scenes import write_split
from typer.testing import CliRunner

from reviewer.cli import app
from reviewer.crossfit.folds import fold_data, write_truth
from reviewer.dataset.importer import ImportSettings, import_split
from reviewer.errors import Conflict, InvalidInput
from reviewer.export.folds import Fold, make_folds
from reviewer.export.selection import Selection, select_labelled
from reviewer.masks import empty_rle
from reviewer.models.nets.checkpoints import load_checkpoint
from reviewer.pipeline.runner import prepare_run, run_pipeline
from reviewer.pipeline.settings import PipelineSettings
from reviewer.store.layers import load_detection
from reviewer.store.pairs import list_pairs, pair_ids
from reviewer.store.revisions import NewRevision, add_revision
from reviewer.store.runs import list_runs, run_of_name
from reviewer.store.trainings import list_trainings

TRAIN = (
    "train cdnet --from-ground-truth --name real --width 0.125 --iterations 2 --batch 2 --crop 64"
    " --validate-every 1 --validation-pairs 2 --precision float32 --class-weight 3"
    " --synthetic-share 0"
).split()


@pytest.fixture
def rooms(db, tmp_path):
    """Two splits of two workspaces, and a run that aligned them."""
    for name, pairs, first in (("cs1", 3, 0), ("hw1", 4, 10)):
        folder = write_split(tmp_path / name, pairs, first)
        import_split(db, name, folder, ImportSettings(), lambda *_: None)
    run = prepare_run(db, "first", PipelineSettings(segmenter="oversegment", detector="difference"))
    run_pipeline(db, run, pair_ids(db))
    return run


def invoke(db, *more):
    return CliRunner().invoke(app, [*TRAIN, *more, "--db", str(db.path)])


def truth_of(db, rooms, tmp_path):
    labelled, _ = select_labelled(db, Selection())
    return labelled, write_truth(db, labelled, tmp_path / "truth", Selection(), rooms)


def test_a_net_a_fold_is_trained_and_judges_what_it_has_not_seen(db, rooms, tmp_path):
    done = invoke(db, "--by", "split")
    assert done.exit_code == 0, done.output + repr(done.exception)
    run = run_of_name(db, "real")
    assert run.detector == "imported" and run.aligner == "dis"
    # Training weighs changed pixels, so the probability that means "changed" moves with it.
    assert run.settings["threshold"] == pytest.approx(3 / 4)
    assert all(load_detection(db, run.id, pair.id) for pair in list_pairs(db))
    assert [t.name for t in list_trainings(db)] == ["real/cs1", "real/hw1"]
    for fold, training in (("cs1", 3), ("hw1", 2)):
        _, record = load_checkpoint(tmp_path / "trainings/real" / fold / "best.pt")
        assert record.training["data"]["fold"] == fold
        assert record.training["data"]["training"] == training
        assert "labelled_validation" in record.training
    table = CliRunner().invoke(
        app, ["evaluate", "--table-a", "--format", "json", "--db", str(db.path)]
    )
    assert {row["run"] for row in json.loads(table.stdout)} == {"first", "real"}
    # The same command again finds all done.
    best = tmp_path / "trainings/real/cs1/best.pt"
    before = best.stat().st_mtime_ns
    again = invoke(db, "--by", "split")
    assert again.exit_code == 0 and best.stat().st_mtime_ns == before
    assert len(list_runs(db)) == 2


def test_pairs_without_ground_truth_are_no_failures(db, rooms, tmp_path):
    from reviewer.store.reviews import annotator_id, set_review_state

    ada = annotator_id(db, "Ada")
    for pair in list_pairs(db)[:5]:
        set_review_state(db, pair.id, ada, "approved")
    done = invoke(db, "--by", "split", "--state", "approved")
    assert done.exit_code == 0, done.output + repr(done.exception)
    failed = db.read().execute("SELECT count(*) FROM failures").fetchone()[0]
    run = run_of_name(db, "real")
    found = [load_detection(db, run.id, pair.id) is not None for pair in list_pairs(db)]
    assert failed == 0 and found == [True] * 5 + [False] * 2


def test_a_name_that_another_run_has_is_told_before_hours_of_training(db, rooms, tmp_path):
    prepare_run(
        db, "real", PipelineSettings(segmenter="oversegment", detector="difference", high=0.5)
    )
    done = invoke(db, "--by", "split")
    assert isinstance(done.exception, Conflict) and not (tmp_path / "trainings").exists()


def test_the_maps_are_those_of_the_fold_that_holds_the_pair_out(db, rooms, tmp_path):
    assert invoke(db, "--by", "split").exit_code == 0
    maps = tmp_path / "trainings/real/maps"
    written = sorted(path.relative_to(maps).as_posix() for path in maps.rglob("*.png"))
    assert written == sorted(f"{pair.split}/{pair.name}.png" for pair in list_pairs(db))
    weights = [
        load_checkpoint(tmp_path / "trainings/real" / fold / "best.pt")[0].state_dict()
        for fold in ("cs1", "hw1")
    ]
    assert any(not torch.equal(value, weights[1][key]) for key, value in weights[0].items())


def test_ground_truth_that_changed_since_needs_another_name(db, rooms, tmp_path):
    labelled, _ = truth_of(db, rooms, tmp_path)
    pair = labelled[0].pair
    add_revision(
        db, NewRevision(pair.id, empty_rle(120, 160), parent=1, annotator_id=None, source="import")
    )
    fresh, _ = select_labelled(db, Selection())
    with pytest.raises(Conflict, match=f"pair {pair.title} was at revision 1; give"):
        write_truth(db, fresh, tmp_path / "truth", Selection(), rooms)
    with pytest.raises(Conflict, match="exported with other pairs"):
        write_truth(db, labelled[1:], tmp_path / "truth", Selection(), rooms)


def test_a_live_image_that_is_tested_and_trained_on_is_refused(db, rooms, tmp_path):
    import_split(db, "lr1", write_split(tmp_path / "lr1"), ImportSettings(), lambda *_: None)
    folds = make_folds(db, list_pairs(db), "split")
    with pytest.raises(InvalidInput, match=r"pair cs1/0000 is to be tested, but lr1/0000, which"):
        fold_data(folds, {}, {})


def test_held_out_pairs_share_no_reference_with_those_trained_on(db, rooms, tmp_path):
    labelled, files = truth_of(db, rooms, tmp_path)
    pairs = [item.pair for item in labelled if item.pair.split == "hw1"]
    (made,) = fold_data([Fold("a", tuple(pairs), ())], files, {"by": "hand"})
    parts = [{each.title for each in part} for part in (made.data.training, made.data.validation)]
    assert len(parts[0] | parts[1]) == 4 and not parts[0] & parts[1] and parts[1]
    with pytest.raises(InvalidInput, match="is trained on 1 reference images, needs 2"):
        fold_data([Fold("b", tuple(pairs[:1]), ())], files, {})
    assert json.loads((tmp_path / "truth" / "manifest.json").read_text())["changed"] == 1


def test_options_of_the_other_kind_of_training_are_refused(db, rooms):
    wrong = invoke(db, "--coco", "x.json")
    assert wrong.exit_code == 1 and "--synthetic-share 0 shows none" in str(wrong.exception)
    done = CliRunner().invoke(app, ["train", "cdnet", "--by", "split", "--db", str(db.path)])
    assert "--by: belongs to --from-ground-truth" in str(done.exception)
