"""The paper's whole pipeline on tiny random weights: LLaVA with Alpha-CLIP, Grounding DINO, SAM 2.

Nothing here says whether the nets are good; it says that they are loaded, asked and resumed as the
real ones are, by the command line, with their weights in the record.
"""

import json

import pytest
from checkpoints import write_alpha_clip, write_grounding_dino, write_llava, write_sam2
from scenes import write_split
from typer.testing import CliRunner

from reviewer.cli import app
from reviewer.models.labellers.phrases import PROMPT
from reviewer.store.database import Store
from reviewer.store.layers import load_labels, load_objects
from reviewer.store.pairs import list_pairs
from reviewer.store.results import stage_keys
from reviewer.store.runs import run_of_name


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    root = tmp_path_factory.mktemp("weights")
    return {
        "llava": write_llava(root / "llava"),
        "alpha": write_alpha_clip(root / "alpha.pth"),
        "dino": write_grounding_dino(root / "dino"),
        "sam2": write_sam2(root / "sam2"),
    }


@pytest.fixture
def paper(weights, tmp_path, monkeypatch):
    """Call `reviewer run` as for the paper, in a folder with an imported split of two pairs."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    write_split(tmp_path / "data" / "cs1", pairs=2)
    CliRunner().invoke(app, ["import", "data"], catch_exceptions=False)

    def run(*more, labeller="llava-alpha"):
        given = ["run", "--name", "paper", "--labeller", f"{labeller}:{weights['alpha']}"]
        given += ["--segmenter", f"grounded-sam:sam2:{weights['sam2']}"]
        given += ["--set", f"label.checkpoint={weights['llava']}"]
        given += ["--set", f"search.grounding={weights['dino']}"]
        given += ["--set", "search.box_threshold=0.2", "--set", "label.precision=float32"]
        given += ["--set", "label.max_new_tokens=8", "--set", "label.stop_list=[]"]
        return CliRunner().invoke(app, [*given, *more], catch_exceptions=False)

    return run


def test_it_runs_resumes_and_keeps_what_it_was_made_with(paper, tmp_path):
    done = paper("--workers", "1")
    assert "2 pairs done" in done.output and done.exit_code == 0, done.output
    with Store(tmp_path / "reviewer.db") as store:
        run = run_of_name(store, "paper")
        own = run.settings["model_settings"]
        assert own["label"]["prompt"] == PROMPT and len(own["label"]["weights"]) == 12
        assert own["search"]["box_threshold"] == 0.2 and "sam2" in own["search"]["weights"]
        changed = list_pairs(store)[0]
        (label,) = load_labels(store, run.id, changed.id)
        assert label.raw and (label.label or label.note)
        if label.label:
            assert load_objects(store, run.id, changed.id)
        keys = stage_keys(store, run.id, [changed.id])
    again = paper("--workers", "1")
    assert "0 pairs done, 2 were done before" in again.output
    resumed = CliRunner().invoke(app, ["run", "--name", "paper"], catch_exceptions=False)
    assert "0 pairs done, 2 were done before" in resumed.output
    with Store(tmp_path / "reviewer.db") as store:
        assert stage_keys(store, run.id, [changed.id]) == keys


def test_words_of_a_vocabulary_are_searched_by_the_same_nets(paper, tmp_path, weights):
    (tmp_path / "words.json").write_text(json.dumps({"1": ["pen", "cup"]}))
    given = ["run", "--name", "words", "--labeller", "vocabulary:words.json", "--workers", "1"]
    given += ["--segmenter", f"grounded-sam:sam2:{weights['sam2']}"]
    given += ["--set", f"search.grounding={weights['dino']}", "--set", "search.box_threshold=0.2"]
    done = CliRunner().invoke(app, given, catch_exceptions=False)
    assert "2 pairs done" in done.output, done.output
    with Store(tmp_path / "reviewer.db") as store:
        run = run_of_name(store, "words")
        changed = list_pairs(store)[0]
        assert [label.label for label in load_labels(store, run.id, changed.id)] == ["pen", "cup"]
        found = load_objects(store, run.id, changed.id)
        assert {thing.side for thing in found} == {"live", "reference"}
        assert {thing.label for thing in found} <= {"pen", "cup", ""}


def test_weights_that_changed_stop_a_run_before_it_does_anything(paper, weights, tmp_path):
    assert paper("--workers", "1").exit_code == 0
    other = write_grounding_dino(tmp_path / "other", seed=5)
    result = CliRunner().invoke(
        app,
        ["run", "--name", "paper", "--set", f"search.grounding={other}"],
    )
    assert "holds other weights" in str(result.exception)
