"""Without the libraries of the extras the daily work goes on; what needs one names its extra."""

import os
import subprocess
import sys

import httpx
import pytest
from scenes import write_split

TOKEN = "extras-test-token"
# None in place of a module is how Python is told that there is none.
WITHOUT = """
import sys
sys.modules.update(dict.fromkeys({missing!r}))
from reviewer.cli import main
main()
"""
EXTRAS = ("matplotlib", "transformers", "huggingface_hub", "embreex", "datasets", "ray")


def command(*words, missing=EXTRAS):
    return [sys.executable, "-u", "-c", WITHOUT.format(missing=missing), *map(str, words)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bare")
    write_split(folder / "data" / "cs1", 2)
    call = caller(folder)
    assert call("import", "data").returncode == 0
    return folder


def caller(folder):
    def call(*words):
        return subprocess.run(command(*words), cwd=folder, capture_output=True, text=True)

    return call


def test_importing_running_scoring_and_exporting_need_no_extra(folder):
    call = caller(folder)
    for words in (
        ("run", "--workers", "1"),
        ("evaluate", "--table-a"),
        ("whatif",),
        ("audit", "report"),
        ("export", "coco", "coco.json"),
        ("export", "t0t1", "set"),
        ("doctor",),
    ):
        done = call(*words)
        assert done.returncode == 0, (words, done.stdout, done.stderr)


def test_the_review_desk_needs_no_extra(folder):
    words = command("serve", "--port", "0", "--token", TOKEN)
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, cwd=folder) as server:
        try:
            base = server.stdout.readline().split()[-1].partition("/sign-in")[0]
            headers = {"Authorization": f"Bearer {TOKEN}"}
            assert httpx.get(f"{base}/api/pairs", headers=headers).json()["total"] == 2
            assert httpx.get(f"{base}/workbench", headers=headers).status_code == 200
        finally:
            server.terminate()


@pytest.mark.parametrize(
    ("words", "library", "extra"),
    [
        (("evaluate", "--figure-e", "bars.png"), "matplotlib", "figures"),
        (("evaluate", "--report", "report.html"), "matplotlib", "figures"),
        (("models", "list"), "huggingface_hub", "models"),
        (("run", "--segmenter", "sam-everything"), "transformers", "models"),
        (("demo", "--dir", "world"), "embreex", "demo"),
        (("synth", "pairs", "--count", "1"), "embreex", "demo"),
    ],
)
def test_what_is_missing_is_named_with_the_extra_that_brings_it(folder, words, library, extra):
    done = caller(folder)(*words)
    assert done.returncode == 2 and "Traceback" not in done.stderr, done.stderr
    wanted = f"reviewer: {words[0]}: needs {library}, which is not installed;"
    assert done.stderr.strip().splitlines()[-1].startswith(wanted)
    assert f"pip install 'reviewer[{extra}]'" in done.stderr


def test_a_training_asks_for_its_curve_before_it_begins(folder):
    words = ["train", "cdnet", "--width", "0.125", "--iterations", "2", "--batch", "2"]
    words = command(*words, "--crop", "64", missing=("matplotlib",))
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, env={**os.environ})
    assert done.returncode == 2 and "train: needs matplotlib" in done.stderr
    assert not (folder / "trainings").exists()
