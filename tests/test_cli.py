"""The command line: a session from import to export, and errors in one line."""

import json
import resource
import signal
import subprocess
import sys

import cv2
import numpy as np
import pytest
import torch
from scenes import write_split
from typer.testing import CliRunner

from reviewer.cli import app, main
from reviewer.dataset.files import hash_file
from reviewer.editing.skipping import skip_pair
from reviewer.errors import ReviewerError
from reviewer.models.nets.checkpoints import load_checkpoint
from reviewer.models.registry import build_detector
from reviewer.store.database import Store
from reviewer.store.layers import load_detection
from reviewer.store.reviews import annotator_id
from reviewer.store.runs import run_of_name
from reviewer.store.trainings import list_trainings


def call(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_split(tmp_path / "data" / "cs1")
    return tmp_path


def test_from_import_to_export(folder):
    imported = call("import", "data")
    assert imported.exit_code == 0, imported.output
    assert "cs1: 3 pairs, 3 with a mask, 0 files skipped, masks: white" in imported.output
    assert "is in the database already" in call("import", "data").output
    ran = call("run", "--name", "first")
    assert "run first: 3 pairs done, 0 were done before, 0 failed" in ran.output
    assert "0 pairs done, 3 were done before" in call("run", "--name", "first").output
    rows = json.loads(call("evaluate", "--format", "json").stdout)
    assert [(r["method"], r["split"]) for r in rows][-1] == ("doi", "mean")
    assert "with DoI" in call("evaluate").output
    assert "3 masks in out; 0 pairs" in call("export", "png", "out").output
    assert call("export", "coco", "coco.json").exit_code == 0
    assert len(json.loads((folder / "coco.json").read_text())["images"]) == 3


def test_an_own_detector_is_brought_in(folder):
    call("import", "data")
    first = call(
        "import-layer", "detection", "data/cs1/mask", "--run", " ours", "--segmenter", "oversegment"
    )
    assert "3 pairs got detection, 0 have none" in first.output, first.output
    ran = call("run", "all", "--name", "ours")
    assert "3 pairs done" in ran.output and "0 failed" in ran.output
    rows = json.loads(call("evaluate", "--run", "ours", "--format", "json").stdout)
    assert rows[0]["method"] == "base" and rows[0]["f_score"] == 1.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(["evaluate"], "database reviewer.db: does not exist"),
     (["import", "nowhere"], "nowhere: is not a folder"),
     (["serve", "--host", "0.0.0.0", "--port", "0"], "can be reached by others"),
     (["serve", "--token-file", "none"], "--token-file none: cannot be read"),
     (["serve", "--token-file", "data/cs1/live/0000.png"], "0000.png: cannot be read"),
     (["serve", "--token-file", "x", "--token", "y"], "is given by --token or REVIEWER_TOKEN, too"),
     (["run", "--detector", "magic"], "detector 'magic': unknown; there are c3po, cdnet, "),
     (["run", "--name", "x", "--low", "0.9", "--high", "0.1"], "need 0 <= low <= high"),
     (["run", "--detector", "cscdnet"], "needs trained weights, --detector cscdnet:CHECKPOINT"),
     (["run", "--detector", "cscdnet:no.pt"], "no.pt: no such checkpoint file"),
     (["train", "cdnet", "--split", "cs7"], "split cs7: does not exist; there are cs1"),
     (["train", "cdnet", "--train-on", "others"], "no split is left"),
     (["train", "cdnet", "--name", "a\x07b"], "run name: holds U+0007"),
     (["train", "cdnet", "--lr", "0"], "training lr: must be > 0"),
     (["train", "cdnet", "--synthesis", "removal=x"], "removal=x: 'x' is no float"),
     (["train", "cdnet", "--synthesis", "size_px=3"], "size_px is 2 numbers with a comma"),
     (["synth", "out", "--synthesis", "magic=1"], "--synthesis magic=1: not NAME=VALUE of changes"),
     (["synth", "out", "--category", "pen"], "--images and --category: belong to --coco"),
     (["synth", "out", "--coco", "no.json"], "no.json: does not exist"),
     (["evaluate", "--run", "none"], "run none: does not exist"),
     (["demo", "--pairs-per-split", "many"], 'a number or "paper"')],
)  # fmt: skip
def test_an_error_is_one_line_and_exit_code_2(folder, monkeypatch, capsys, arguments, message):
    if arguments[0] in ("run", "serve", "train", "synth") or "--run" in arguments:
        call("import", "data")
    monkeypatch.setattr(sys, "argv", ["reviewer", *arguments])
    with pytest.raises(SystemExit) as stopped:
        main()
    captured = capsys.readouterr()
    assert stopped.value.code == 2
    assert message in captured.err and captured.err.count("\n") == 1
    assert isinstance(stopped.value.__context__, ReviewerError)


def test_the_token_comes_from_a_file_or_the_environment(folder, monkeypatch):
    call("import", "data")
    served = []
    monkeypatch.setattr("reviewer.app.server.serve_app", lambda db, **given: served.append(given))
    (folder / "token").write_text("a-token-of-a-file\n")
    assert call("serve", "--token-file", "token", "--proxy", "10.0.0.1").exit_code == 0
    monkeypatch.setenv("REVIEWER_TOKEN", "a-token-of-the-environment")
    assert call("serve").exit_code == 0
    assert [given["token"] for given in served] == [
        "a-token-of-a-file", "a-token-of-the-environment",
    ]  # fmt: skip
    assert [given["proxies"] for given in served] == [["10.0.0.1"], []]


def in_one_line(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["reviewer", *arguments])
    with pytest.raises(SystemExit) as stopped:
        main()
    told = capsys.readouterr().err
    assert stopped.value.code == 2 and told.count("\n") == 1, told
    return told


def test_a_database_that_cannot_be_written_is_one_line(folder, monkeypatch, capsys):
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        told = in_one_line(monkeypatch, capsys, "import", "data")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert "reviewer.db: the disk does not read or write it" in told and "Error" not in told


def test_a_full_disk_is_one_line(folder, monkeypatch, capsys):
    call("import", "data")

    def fail(*_):
        raise OSError(28, "No space left on device", "out/0000.png")

    monkeypatch.setattr("pathlib.Path.write_bytes", fail)
    told = in_one_line(monkeypatch, capsys, "export", "png", "out")
    assert told == "reviewer: out/0000.png: No space left on device\n"


def test_a_killed_run_resumes(folder):
    call("import", "data")
    code = (
        "import os, signal, reviewer.pipeline.runner as r\n"
        "whole = r.save_results\n"
        "def dies(*a):\n"
        "    whole(*a)\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
        "r.save_results = dies\n"
        "import sys; sys.argv = ['reviewer', 'run', '--name', 'x', '--workers', '1']\n"
        "from reviewer.cli import main; main()\n"
    )
    assert subprocess.run([sys.executable, "-c", code], cwd=folder).returncode == -signal.SIGKILL
    again = call("run", "--name", "x")
    assert "run x: 2 pairs done, 1 were done before, 0 failed" in again.output


@pytest.fixture
def blocks(folder):
    """A COCO file with three blocks to paste, and the imported split."""
    call("import", "data")
    picture = np.full((60, 150, 3), 20, np.uint8)
    annotations = []
    for k, colour in enumerate([(20, 20, 240), (240, 40, 20), (240, 240, 240)]):
        x = 50 * k + 5
        picture[10:40, x : x + 40] = colour
        polygon = [[x, 10, x + 40, 10, x + 40, 40, x, 40]]
        annotations.append(
            {"id": k, "image_id": 1, "category_id": 1, "area": 1200, "segmentation": polygon}
        )
    (folder / "coco" / "images").mkdir(parents=True)
    cv2.imwrite(str(folder / "coco" / "images" / "a.png"), picture)
    content = {
        "images": [{"id": 1, "file_name": "a.png"}],
        "annotations": annotations,
        "categories": [{"id": 1, "name": "block"}],
    }
    (folder / "coco" / "instances.json").write_text(json.dumps(content))
    return ["--coco", "coco/instances.json"]


def test_synthetic_pairs_become_a_folder_that_can_be_imported(folder, blocks):
    made = call("synth", "synthetic", "--count", "3", "--synthesis", "size_px=9,40", *blocks)
    assert made.exit_code == 0, made.output
    assert "3 objects to paste from coco/instances.json" in made.output
    assert "3 pairs in synthetic; look at synthetic/contact-sheet.png" in made.output
    record = json.loads((folder / "synthetic" / "synthesis.json").read_text())
    assert record["synthesis"]["size_px"] == [9, 40] and record["data"]["references"] == 3
    imported = call("import", "synthetic", "--layout", "t0t1", "--polarity", "white")
    assert "synthetic: 3 pairs, 3 with a mask, 0 files skipped" in imported.output


def test_from_training_over_a_kill_to_a_run(folder, blocks):
    words = [
        *["train", "cdnet", "--width", "0.125", "--iterations", "4", "--batch", "2"],
        *["--crop", "64", "--validate-every", "2", "--validation-pairs", "2", *blocks],
    ]
    code = (
        "import os, sys, reviewer.training.session as s\n"
        "add = s.Log.add\n"
        "s.Log.add = lambda log, step: os._exit(9) if step.iteration == 3 else add(log, step)\n"
        f"sys.argv = {['reviewer', *words]!r}\n"
        "from reviewer.cli import main; main()\n"
    )
    assert subprocess.run([sys.executable, "-c", code], cwd=folder).returncode == 9
    done = call(*words)
    assert done.exit_code == 0, done.output
    assert "encoders start from random weights" in done.output
    assert "iteration 4: F " in done.output and "iteration 2: F " not in done.output
    assert "cdnet: 4 iterations; best F on synthetic validation" in done.output
    with Store(folder / "reviewer.db") as store:
        (training,) = list_trainings(store)
    assert training.iteration == 4 and training.checkpoint == "trainings/cdnet/best.pt"
    assert training.settings["data"]["splits"] == []
    best = folder / training.checkpoint
    assert training.checkpoint_sha256 == hash_file(best)
    said = call("checkpoint", best)
    assert "cdnet, width 0.125, 1.45 M parameters" in said.output
    assert "trained here: iteration" in said.output
    ran = call("run", "--name", "net", "--detector", f"cdnet:{best}")
    assert "run net: 3 pairs done, 0 were done before, 0 failed" in ran.output, ran.output
    assert "0 pairs done, 3 were done before" in call("run", "--name", "net").output
    with Store(folder / "reviewer.db") as store:
        settings = run_of_name(store, "net").settings
        detection = load_detection(store, run_of_name(store, "net").id, 1)
    assert settings["threshold"] == 0.5
    assert settings["model_settings"]["detect"]["checkpoint"] == str(best)
    assert detection.probability_png is not None


def test_a_public_checkpoint_gets_its_record(folder):
    torch.save(build_detector("cscdnet", 0.125).state_dict(), folder / "public.pth")
    words = ["--net", "cscdnet-attention", "--bn-mode", "batch", "--threshold", "0.4"]
    saved = call("checkpoint", "public.pth", "--save", "ours.pt", *words)
    assert "next: reviewer run --detector cscdnet-attention:ours.pt" in saved.output
    _, record = load_checkpoint(folder / "ours.pt")
    assert (record.net, record.bn_mode, record.threshold) == ("cscdnet-attention", "batch", 0.4)
    assert "changed: class 1 where p > 0.4" in call("checkpoint", "ours.pt").output
    call("import", "data")
    call("run", "detect", "--name", "net", "--detector", "cscdnet-attention:ours.pt")
    with Store(folder / "reviewer.db") as store:
        assert run_of_name(store, "net").settings["threshold"] == 0.4


def test_the_pages_made_from_the_code_are_up_to_date():
    done = subprocess.run(
        [sys.executable, "docs/generate.py", "--check"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_layers_that_lie_in_folders_are_brought_in_by_a_run(folder):
    call("import", "data")
    for name in ("flows", "maps", "objects/live", "objects/reference"):
        (folder / name / "cs1").mkdir(parents=True)
    for k in range(3):
        np.save(folder / f"flows/cs1/{k:04d}.npy", np.zeros((120, 160, 2), np.float32))
        mask = np.zeros((120, 160), np.float32)
        mask[40:60, 50 + 10 * k : 75 + 10 * k] = 0.9
        np.save(folder / f"maps/cs1/{k:04d}.npy", mask)
        np.save(folder / f"objects/live/cs1/{k:04d}.npy", mask[None] > 0.5)
        np.save(folder / f"objects/reference/cs1/{k:04d}.npy", np.zeros((0, 120, 160), bool))
    given = ["--name", "ours", "--aligner", "files:flows", "--detector", "files:maps"]
    ran = call("run", *given, "--segmenter", "files:objects", "--workers", "1")
    assert "alignment: 3 pairs from flows" in ran.output and "3 pairs done" in ran.output
    again = call("run", "--name", "ours", "--workers", "1")
    assert "0 pairs done, 3 were done before" in again.output
    listed = json.loads(call("runs", "list", "--json").output)[0]
    assert listed["members"] == "imported imported none imported"
    refused = call("run", "--name", "x", "--labeller", "files:maps")
    assert "use vocabulary:FILE" in str(refused.exception)


def test_without_a_terminal_progress_is_a_line_now_and_then(folder, monkeypatch):
    monkeypatch.setattr("reviewer.cli.options.LOG_EVERY_S", 0.0)
    call("import", "data")
    ran = call("run", "--name", "x", "--workers", "1")
    lines = [line for line in ran.stderr.splitlines() if line.startswith("x: ")]
    assert len(lines) == 3 and " of 3, all, " in lines[0]
    assert "pairs/s" in lines[0] and lines[-1].endswith("0 min left")


def test_runs_are_compared_with_the_two_pictures_swapped(folder):
    call("import", "data")
    call("run", "--name", "a", "--workers", "1", "--detector", "difference")
    call(
        "run",
        "--name",
        "b",
        "--workers",
        "1",
        "--detector",
        "difference",
        "--set",
        "detect.middle=6",
    )
    told = json.loads(call("runs", "compare", "a", "b", "--swapped", "--json").stdout)
    assert [each["run"] for each in told["swapped"]] == ["a", "b"]
    row = told["swapped"][0]["splits"][-1]
    assert row["split"] == "mean" and row["F"] > 0.5 and 0 <= row["swapped"] <= 1
    text = call("runs", "compare", "a", "a", "--swapped").stdout
    assert text.count("when they are swapped") == 1
    assert "F of the detector alone, reference and live swapped" in text


def test_runs_are_listed_shown_compared_and_deleted(folder):
    call("import", "data")
    call("run", "--name", "a", "--workers", "1", "--detector", "difference")
    call(
        "run",
        "--name",
        "b",
        "--workers",
        "1",
        "--high",
        "0.5",
        "--detector",
        "difference",
        "--set",
        "detect.middle=6",
    )
    call("evaluate")
    listed = {row["run"]: row for row in json.loads(call("runs", "list", "--json").output)}
    assert [listed["a"][key] for key in ("done", "failed", "scored")] == [3, 0, 3]
    assert 0 <= listed["a"]["F with DoI"] <= 1
    shown = json.loads(call("runs", "show", "b", "--json").output)
    assert shown["settings"]["model_settings"]["detect"]["middle"] == 6
    assert [stage["done"] for stage in shown["stages"]] == [3] * 5
    compared = json.loads(call("runs", "compare", "a", "b", "--json").output)
    assert {row["setting"] for row in compared["settings"]} == {
        "high",
        "model_settings.detect.middle",
    }
    assert {row["split"] for row in compared["splits"]} == {"cs1", "mean"}
    assert "swapped" not in compared
    assert "run a: deleted" in call("runs", "delete", "a", "--yes").output
    assert [row["run"] for row in json.loads(call("runs", "list", "--json").output)] == ["b"]


@pytest.mark.parametrize(
    ("given", "message"),
    [(["--set", "box_threshold=3"], "write STAGE.SETTING=VALUE"),
     (["--segmenter", "oversegment", "--set", "search.nothing=3"],
      "'nothing'; it has scale, sigma, least_px"),
     (["--segmenter", "oversegment:here"], "it takes no path"),
     (["--labeller", "vocabulary"], "needs words"),
     (["--labeller", "vocabulary:none.json"], "cannot be read"),
     (["--segmenter", "grounded-sam"], "searches for names, but labeller none gives none"),
     (["--address", "auto"], "is for --engine ray")],
)  # fmt: skip
def test_what_a_run_cannot_do_is_said_at_once(folder, given, message):
    call("import", "data")
    result = call("run", *given)
    assert isinstance(result.exception, ReviewerError) and message in str(result.exception)


def test_the_doctors_exit_code_tells_scripts(folder):
    call("import", "data")
    sound = call("doctor", "--json")
    assert sound.exit_code == 0, sound.output
    assert {check["finding"] for check in json.loads(sound.output)} <= {"good", "note"}
    (folder / "data" / "cs1" / "live" / "0000.png").unlink()
    broken = call("doctor")
    assert broken.exit_code == 1 and "✗ images:" in broken.output


def test_models_are_listed_with_their_licences(folder):
    listed = json.loads(call("models", "list", "--json").output)
    assert {row["name"] for row in listed} >= {"sam2-tiny", "grounding-dino-base", "alpha-clip"}
    assert "Apache-2.0" in call("models", "list").output
    assert "sam2-tiny, sam2-small" in str(call("models", "fetch", "sam9").exception)


def test_other_rules_are_scored_without_a_run(folder):
    call("import", "data")
    call("run", "--name", "a", "--workers", "1")
    call("run", "--name", "b", "--workers", "1", "--high", "0.05")
    call("evaluate")
    listed = json.loads(call("runs", "list", "--json").output)
    means = {row["run"]: row["F with DoI"] for row in listed}
    found = call("whatif", "high", "--values", "0.05,0.9", "--run", "a", "--json")
    rows = {row["rule"]: row["mean F"] for row in json.loads(found.output)}
    assert rows["high 0.9"] == pytest.approx(means["a"])
    assert rows["high 0.05"] == pytest.approx(means["b"])
    assert rows["oracle"] >= max(rows["detector alone"], rows["high 0.9"])
    for scope in ("component", "image"):
        for seen in ("keep", "reject"):
            call("run", "--name", f"{scope} {seen}", "--scope", scope, "--seen", seen)
            call("evaluate")
            listed = json.loads(call("runs", "list", "--json").output)
            means = {row["run"]: row["F with DoI"] for row in listed}
            given = ["--run", "a", "--scope", scope, "--seen", seen]
            found = call("whatif", "high", "--values", "0.9", *given, "--json")
            rows = {row["rule"]: row["mean F"] for row in json.loads(found.output)}
            assert rows["high 0.9"] == pytest.approx(means[f"{scope} {seen}"])
            assert rows["oracle"] >= rows["high 0.9"]
            shown = " ".join(call("whatif", *given).output.split())
            assert f"scope {scope}, f_b = 0: {seen}" in shown
    assert "must be numbers" in str(call("whatif", "high", "--values", "x").exception)


def test_pairs_skipped_as_badly_aligned_are_left_out_and_counted(folder):
    call("import", "data")
    call("run", "--name", "first")
    with Store(folder / "reviewer.db") as store:
        skip_pair(
            store, 2, annotator_id(store, "Ada"), run_of_name(store, "first"), "badly aligned"
        )
    exported = call("export", "t0t1", "set")
    assert "2 masks in set" in exported.output
    assert "left out: 1 pair skipped as badly aligned" in exported.output
    manifest = json.loads((folder / "set" / "manifest.json").read_text())
    assert manifest["settings"]["skipped"] == ["cs1/0001"] and len(manifest["pairs"]) == 2
    everything = call("export", "t0t1", "all", "--with-skipped")
    assert "3 masks in all" in everything.output and "left out" not in everything.output
    scored = call("evaluate", "--format", "json")
    assert "left out: 1 pair skipped as badly aligned" in scored.stderr
    assert {line["pairs"] for line in json.loads(scored.stdout)} == {2}
