"""The built wheel, installed outside the checkout, serves the app with its files and migrations."""

import os
import site
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import httpx
import pytest
from scenes import write_split

from reviewer.training.small_session import WEIGHTS

ROOT = Path(__file__).resolve().parent.parent
TOKEN = "wheel-test-token"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder)]
    done = subprocess.run([*command, str(ROOT)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """A fresh environment with the wheel; libraries come from the one that runs the tests."""
    folder = tmp_path_factory.mktemp("env")
    venv.create(folder, with_pip=False)
    python = folder / ("Scripts" if os.name == "nt" else "bin") / "python"
    own = subprocess.run(
        [python, "-c", "import site; print(site.getsitepackages()[0])"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    packages = Path(own.stdout.strip())
    (packages / "libraries.pth").write_text("\n".join(site.getsitepackages()))
    command = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", str(packages)]
    subprocess.run([*command, "--disable-pip-version-check", str(wheel)], check=True)
    return python


def run(python, *arguments, cwd):
    code = "from reviewer.cli import main; main()"
    return subprocess.run(
        [python, "-c", code, *map(str, arguments)], capture_output=True, text=True, cwd=cwd
    )


def test_the_wheel_holds_static_files_and_migrations(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    shipped = {f"reviewer/_shipped/{p.relative_to(ROOT).as_posix()}"
               for folder in ("static", "db") for p in (ROOT / folder).rglob("*.*")
               if "__pycache__" not in p.parts}  # fmt: skip
    assert shipped <= names


def test_the_wheel_holds_the_weights_of_the_small_nets(wheel):
    with zipfile.ZipFile(wheel) as content:
        for name in WEIGHTS.values():
            path = f"reviewer/models/nets/shipped/{name}.safetensors"
            assert content.read(path) == (ROOT / path).read_bytes()


def test_the_installed_wheel_imports_and_serves(installed, tmp_path):
    where = subprocess.run(
        [installed, "-c", "import reviewer; print(reviewer.__file__)"],
        capture_output=True, text=True, cwd=tmp_path,
    )  # fmt: skip
    assert str(ROOT) not in where.stdout
    write_split(tmp_path / "cs1", 1)
    done = run(installed, "import", "cs1", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    code = "from reviewer.cli import main; main()"
    command = [installed, "-u", "-c", code, "serve", "--port", "0", "--token", TOKEN]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=tmp_path) as server:
        try:
            link = server.stdout.readline().split()[-1]
            base = link.partition("/sign-in")[0]
            headers = {"Authorization": f"Bearer {TOKEN}"}
            assert httpx.get(link).status_code == 200
            assert httpx.get(f"{base}/api/pairs", headers=headers).json()["total"] == 1
            page = httpx.get(f"{base}/workbench", headers=headers).text
            assert "/static/js/main.js" in page
            script = httpx.get(f"{base}/static/js/main.js", headers=headers)
            assert script.text == (ROOT / "static" / "js" / "main.js").read_text()
        finally:
            server.terminate()
