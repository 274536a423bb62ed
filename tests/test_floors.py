"""The house's statics: imports go downwards, files stay small, the command line stays light."""

import ast
import re
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
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
    "flows": 3,
    "dataset": 2,
    "demo": 2,
    "synthesis": 2,
    "training": 2,
    "pipeline": 2,
    "evaluation": 2,
    "reports": 2,
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
    "caching",
    "doi",
    "metrics",
    "masks",
    "geometry",
    "records",
    "errors",
    "texts",
    "extras",
    "shipped",
    "version",
    "words",
}
# Within floor 2 the data flows left to right; nothing flows backwards.
ORDER_ON_FLOOR_2 = [
    "dataset",
    "demo",
    "synthesis",
    "training",
    "pipeline",
    "evaluation",
    "reports",
    "export",
    "crossfit",
    "doctor",
    "found",
    "inspection",
    "scripting",
]

# The workbench, floor by floor, the lowest first: a module, or a folder of them. A script imports
# from its own floor and from lower ones.
SCRIPTS = ROOT / "static" / "js"
SCRIPT_IMPORT = re.compile(
    r'^(?:import|export)\s(?:[\w*{},\s$]*\sfrom\s)?"(\.[^"]+)"', re.MULTILINE
)
SCRIPT_FLOORS = {
    "pure": [
        "activity",
        "cleanup",
        "fill",
        "geometry",
        "history",
        "keys",
        "merging",
        "news",
        "outline",
        "page",
        "panels/symbols",
        "presets",
        "proposals",
        "raster",
        "rle",
        "rle_cache",
        "tools/",
        "truth",
        "wire",
    ],
    "state": [
        "api",
        "audit_walk",
        "journal",
        "memory",
        "questions",
        "saver",
        "state",
    ],
    "document": ["document"],
    "hand": ["tools/hand", "tools/toolbox"],
    "session": ["pair_session", "verdicts"],
    "view": [
        "chrome",
        "controls",
        "desk_link",
        "layers",
        "looking",
        "loupe",
        "marks",
        "maskview",
        "overlays",
        "panes",
        "pointer",
        "shell/",
        "standing",
        "strip",
        "surroundings",
        "sweep",
        "view",
    ],
    "panels": ["actions", "fields", "modes", "panels/", "save_status", "side", "taking"],
    "main": ["main"],
}


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


def package_imports() -> dict[str, set[str]]:
    """Which module imports which, inside functions and for types too."""
    names = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
        for path in modules()
    }
    found: dict[str, set[str]] = {}
    for name, path in names.items():
        targets = set()
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                targets |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                inner = {f"{node.module}.{alias.name}" for alias in node.names}
                targets |= (inner & set(names)) or {str(node.module)}
        found[name] = targets & set(names) - {name}
    return found


def script_imports() -> dict[str, set[str]]:
    """Which script imports which; types in comments do not count."""
    found = {}
    for path in sorted(SCRIPTS.rglob("*.js")):
        targets = SCRIPT_IMPORT.findall(path.read_text())
        found[script_name(path)] = {
            script_name((path.parent / target).resolve()) for target in targets
        }
    return found


def script_name(path: Path) -> str:
    return path.relative_to(SCRIPTS).with_suffix("").as_posix()


def script_floor(name: str) -> int:
    # A module that has a floor of its own does not stand on that of its folder.
    for entry in (name, f"{name.rpartition('/')[0]}/"):
        for number, names in enumerate(SCRIPT_FLOORS.values()):
            if entry in names:
                return number
    raise AssertionError(f"static/js/{name}.js: give it a floor in SCRIPT_FLOORS")


@pytest.mark.parametrize("graph", [package_imports, script_imports])
def test_no_import_leads_back_to_where_it_began(graph):
    imports = graph()
    assert len(imports) > 40
    try:
        TopologicalSorter(imports).prepare()
    except CycleError as error:
        pytest.fail(f"these import one another: {' <- '.join(error.args[1])}")


def test_a_script_imports_only_from_its_own_floor_and_lower_ones():
    for name, targets in script_imports().items():
        here = script_floor(name)
        for target in targets:
            assert script_floor(target) <= here, f"{name} must not import {target}"


def test_the_floors_of_the_scripts_name_what_there_is():
    there = {script_name(path) for path in SCRIPTS.rglob("*.js")}
    there |= {f"{path.name}/" for path in SCRIPTS.iterdir() if path.is_dir()}
    named = [name for names in SCRIPT_FLOORS.values() for name in names]
    assert set(named) <= there
    assert len(named) == len(set(named))


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


STATE_WRITE = re.compile(
    r"\bstate(?:\.\w+|\[\w+\])+\s*(?:(?:[-+*/|&?]{0,2}=(?![=>]))|\+\+|--)"
    r"|Object\.assign\((?:this\.)?state\b"
)


def test_the_state_of_the_workbench_changes_only_through_its_own_methods():
    assert all(
        STATE_WRITE.search(line)
        for line in ("state.tool = name;", "state[name] = 1", "Object.assign(this.state.pair, it)")
    )
    assert not STATE_WRITE.search('if (state.mode === "audit") act(() => state.view)')
    writes = [
        f"{path.name}:{number}: {line.strip()}"
        for path in (ROOT / "static/js").rglob("*.js")
        if path.name != "state.js" and "shell" not in path.parts
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if STATE_WRITE.search(line)
    ]
    assert writes == []


def test_help_imports_no_heavy_library():
    code = (
        "import sys; from typer.testing import CliRunner; from reviewer.cli import app;"
        "result = CliRunner().invoke(app, ['--help']); assert result.exit_code == 0, result.output;"
        "heavy = {'torch','transformers','matplotlib','cv2','numpy','viser','skimage','trimesh'};"
        "found = heavy & set(sys.modules); assert not found, found"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
