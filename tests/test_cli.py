"""The command line: a session from import to export, and errors in one line."""

import json
import subprocess
import sys

import pytest
from scenes import write_split
from typer.testing import CliRunner

from reviewer.cli import app, main
from reviewer.errors import ReviewerError


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
    assert "cs1: 3 pairs, 0 files skipped, masks: white = changed (guessed" in imported.output
    assert "is in the database already" in call("import", "data").output
    ran = call("run", "--name", "first")
    assert "run first: 3 pairs done, 0 were done before, 0 failed" in ran.output
    assert "0 pairs done, 3 were done before" in call("run", "--name", "first").output
    rows = json.loads(call("evaluate", "--format", "json").output)
    assert [(r["method"], r["split"]) for r in rows][-1] == ("doi", "mean")
    assert "with DoI" in call("evaluate").output
    assert "3 masks in out; 0 pairs" in call("export", "png", "out").output
    assert call("export", "coco", "coco.json").exit_code == 0
    assert len(json.loads((folder / "coco.json").read_text())["images"]) == 3


def test_an_own_detector_is_brought_in(folder):
    call("import", "data")
    first = call(
        "import-layer", "detection", "data/cs1/mask", "--run", "ours", "--segmenter", "oversegment"
    )
    assert "3 pairs got detection, 0 have none" in first.output, first.output
    ran = call("run", "all", "--name", "ours")
    assert "3 pairs done" in ran.output and "0 failed" in ran.output
    rows = json.loads(call("evaluate", "--run", "ours", "--format", "json").output)
    assert rows[0]["method"] == "base" and rows[0]["f_score"] == 1.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(["evaluate"], "database reviewer.db: does not exist"),
     (["import", "nowhere"], "nowhere: is not a folder"),
     (["serve", "--host", "0.0.0.0", "--port", "0"], "can be reached by others"),
     (["run", "--detector", "magic"], "detector 'magic': unknown; there are difference"),
     (["run", "--name", "x", "--low", "0.9", "--high", "0.1"], "need 0 <= low <= high"),
     (["evaluate", "--run", "none"], "run none: does not exist"),
     (["demo", "--pairs-per-split", "many"], 'a number or "paper"')],
)  # fmt: skip
def test_an_error_is_one_line_and_exit_code_2(folder, monkeypatch, capsys, arguments, message):
    if arguments[0] in ("run", "serve") or "--run" in arguments:
        call("import", "data")
    monkeypatch.setattr(sys, "argv", ["reviewer", *arguments])
    with pytest.raises(SystemExit) as stopped:
        main()
    captured = capsys.readouterr()
    assert stopped.value.code == 2
    assert message in captured.err and captured.err.count("\n") == 1
    assert isinstance(stopped.value.__context__, ReviewerError)


def test_a_killed_run_resumes(folder):
    call("import", "data")
    code = (
        "import os, reviewer.pipeline.runner as r\n"
        "whole = r._run_pair\n"
        "def dies(*a):\n"
        "    whole(*a)\n"
        "    os._exit(9)\n"
        "r._run_pair = dies\n"
        "import sys; sys.argv = ['reviewer', 'run', '--name', 'x', '--workers', '1']\n"
        "from reviewer.cli import main; main()\n"
    )
    assert subprocess.run([sys.executable, "-c", code], cwd=folder).returncode == 9
    again = call("run", "--name", "x")
    assert "run x: 2 pairs done, 1 were done before, 0 failed" in again.output


def test_the_pages_made_from_the_code_are_up_to_date():
    done = subprocess.run(
        [sys.executable, "docs/generate.py", "--check"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
