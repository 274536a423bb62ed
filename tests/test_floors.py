"""The house's statics: imports go downwards, files stay small, the command line stays light."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "reviewer"
FLOOR = {
    "__init__": 5,  # the door for scripts, `reviewer.open`
    "__main__": 6,  # `python -m reviewer` calls the command line
    "cli": 5,
    "app": 4,
    "editing": 3,
    "dataset": 2,
    "synthesis": 2,
    "training": 2,
    "pipeline": 2,
    "evaluation": 2,
    "export": 2,
    "crossfit": 2,
    "doctor": 2,
    "found": 2,
    "inspection": 2,
    "scripting": 2,
    "store": 1,
    "models": 1,
}
GROUND = {
    "atomic",
    "doi",
    "metrics",
    "masks",
    "geometry",
    "records",
    "errors",
    "texts",
    "extras",
    "shipped",
    "__init__",
}
# Within floor 2 the data flows left to right; nothing flows backwards.
ORDER_ON_FLOOR_2 = [
    "dataset",
    "synthesis",
    "training",
    "pipeline",
    "evaluation",
    "export",
    "crossfit",
    "doctor",
    "found",
    "inspection",
    "scripting",
]


def room(module: str) -> str:
    """The first name below `reviewer`: reviewer.store.masks -> store."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else "__init__"


def modules() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def imported_rooms(path: Path) -> set[str]:
    rooms = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            rooms |= {room(a.name) for a in node.names if a.name.split(".")[0] == "reviewer"}
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "reviewer":
            if node.module == "reviewer":
                rooms |= {a.name for a in node.names if not a.name.startswith("__")}
            else:
                rooms.add(room(node.module))
    return rooms


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_a_module_imports_only_from_lower_floors_or_its_own_package(path):
    own = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    for target in imported_rooms(path) - {own}:
        if target in GROUND:
            continue
        here, there = FLOOR.get(own, 0), FLOOR[target]
        sideways = (
            own in ORDER_ON_FLOOR_2
            and target in ORDER_ON_FLOOR_2
            and ORDER_ON_FLOOR_2.index(target) < ORDER_ON_FLOOR_2.index(own)
        )
        assert there < here or sideways, f"{path}: {own} must not import {target}"


@pytest.mark.parametrize(
    "path",
    [*modules(), *sorted((ROOT / "static").rglob("*.js")), *sorted((ROOT / "db").glob("*.py"))],
    ids=lambda p: str(p.relative_to(ROOT)),
)
def test_a_file_has_at_most_400_lines(path):
    assert len(path.read_text().splitlines()) <= 400


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_every_module_says_what_it_is(path):
    assert ast.get_docstring(ast.parse(path.read_text()))


def test_help_imports_no_heavy_library():
    code = (
        "import sys; from typer.testing import CliRunner; from reviewer.cli import app;"
        "result = CliRunner().invoke(app, ['--help']); assert result.exit_code == 0, result.output;"
        "heavy = {'torch','transformers','matplotlib','cv2','numpy','viser','skimage','trimesh'};"
        "found = heavy & set(sys.modules); assert not found, found"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
