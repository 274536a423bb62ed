"""Commands on a database without pairs say so, and what brings pairs in."""

import subprocess
import sys

import pytest
from typer.testing import CliRunner

from reviewer.cli import app
from reviewer.errors import NotFound
from reviewer.store.database import Store


@pytest.mark.parametrize(
    "command",
    [["run"], ["run", "detect"], ["evaluate"], ["evaluate", "--shapes"], ["evaluate", "--table-a"]],
)
def test_without_pairs_there_is_nothing_to_run_or_score(tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    Store(tmp_path / "reviewer.db", create=True).close()
    with pytest.raises(
        NotFound, match=r"reviewer\.db: holds no pairs; bring some in with: reviewer import DIR"
    ):
        CliRunner().invoke(app, command, catch_exceptions=False)
    with Store(tmp_path / "reviewer.db") as store:
        assert store.read().execute("SELECT count(*) FROM runs").fetchone()[0] == 0


def test_the_package_is_a_command_too(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "reviewer", "import", "nowhere"],
        cwd=tmp_path, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 2 and "nowhere: is not a folder" in done.stderr
