"""Every list of words stands once, and what a word is looked up in knows all of them."""

import ast
import subprocess
import sys
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import pytest

from reviewer import words
from reviewer.app.panels.queue import ORDER_TITLE, STATE_TITLE, TEAM_TITLE
from reviewer.cli.machine import SIGN
from reviewer.cli.whatif import DEFAULT_VALUES
from reviewer.dataset.layers import STAGE
from reviewer.dataset.layouts import FOLDERS
from reviewer.dataset.mask_importer import READERS
from reviewer.evaluation.audit import DECIDED
from reviewer.evaluation.basis import TITLES as STANDING_TITLES
from reviewer.evaluation.table_a import TITLES as NET_TITLES
from reviewer.evaluation.tables import METHOD_TITLE
from reviewer.export.formats import PLAIN
from reviewer.export.t0t1 import CHANGED
from reviewer.models.clicks.sam import CLASSES as SAM_CLASSES
from reviewer.models.clicks.sam import MODEL_TYPES
from reviewer.models.member_settings import CLASSES
from reviewer.models.nets.build import NETS
from reviewer.pipeline.plan import STAGE_VERSIONS
from reviewer.store.audit_queue import ORDERS as WALK_ORDERS
from reviewer.store.queue import ORDERS
from reviewer.store.results import LAYER_TABLES
from reviewer.training.settings import FAMILY
from reviewer.training.small_session import SETTINGS, VIEWS_PX, WEIGHTS

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "reviewer"
LISTS = {
    name: frozenset(get_args(value))
    for name, value in vars(words).items()
    if get_origin(value) is Literal
}


def texts(nodes: list[ast.expr]) -> frozenset[str]:
    """The strings of a list, none when something else is in it, or fewer than two."""
    found = [n.value for n in nodes if isinstance(n, ast.Constant) and isinstance(n.value, str)]
    return frozenset(found) if len(found) == len(nodes) > 1 else frozenset()


def word_lists(source: str) -> Iterator[tuple[int, str, frozenset[str]]]:
    """Every Literal, tuple and set of strings: its line, its kind and its words."""
    tree = ast.parse(source)
    inside = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Subscript) and ast.unparse(node.value).endswith("Literal"):
            inside.add(node.slice)
            if isinstance(node.slice, ast.Tuple) and (found := texts(node.slice.elts)):
                yield node.lineno, "Literal", found
    for node in ast.walk(tree):
        if isinstance(node, ast.Tuple | ast.Set) and node not in inside:
            if found := texts(node.elts):
                yield node.lineno, type(node).__name__, found


def doubles(source: str) -> list[str]:
    return [
        f"line {line}: {kind} of {', '.join(sorted(found))}"
        for line, kind, found in word_lists(source)
        if kind == "Literal" or found in LISTS.values()
    ]


def test_the_lists_are_found():
    assert len(LISTS) > 40
    assert LISTS["Side"] == {"live", "reference"}


@pytest.mark.parametrize(
    "source",
    [
        'Side = Literal["live", "reference"]',
        'def f(mine: Annotated[typing.Literal["a", "b"] | None, 1]): ...',
        'if side in ("reference", "live"): ...',
        'known = {"adopt", "keep", "reject"}',
    ],
)
def test_a_list_written_again_is_told(source):
    assert len(doubles(source)) == 1


@pytest.mark.parametrize("source", ['kind: Literal["step"]', 'found = ("live", 3)', '("a", "b")'])
def test_what_is_no_list_of_words_is_not_told(source):
    assert doubles(source) == []


def test_no_list_of_words_stands_twice():
    paths = [path for path in PACKAGE.rglob("*.py") if path.name != "words.py"]
    assert len(paths) > 200
    told = [
        f"{path.relative_to(ROOT)}, {double}"
        for path in paths
        for double in doubles(path.read_text())
    ]
    assert told == []


def test_no_two_lists_are_of_the_same_words():
    assert len(set(LISTS.values())) == len(LISTS)


@pytest.mark.parametrize(
    ("looked_up", "word"),
    [
        (ORDERS, words.QueueOrder),
        (ORDER_TITLE, words.QueueOrder),
        (STATE_TITLE, words.PairState),
        (TEAM_TITLE, words.TeamState),
        (STANDING_TITLES, words.Standing),
        (WALK_ORDERS, words.WalkOrder),
        (DECIDED, words.Seen),
        (DEFAULT_VALUES, words.Vary),
        (METHOD_TITLE, words.Method),
        (SIGN, words.Finding),
        (STAGE_VERSIONS, words.Stage),
        (LAYER_TABLES, words.MemberStage),
        (CLASSES, words.MemberStage),
        (FOLDERS, words.Layout),
        (READERS, words.AnnotationTool),
        (STAGE, words.LayerKind),
        ({*PLAIN, "coco", "t0t1", "folds"}, words.ExportFormat),
        (CHANGED, words.IgnoreMode),
        (NETS, words.NetName),
        (FAMILY, words.TrainedNet),
        (SETTINGS, words.SmallNet),
        (WEIGHTS, words.SmallNet),
        (VIEWS_PX, words.SmallNet),
        (NET_TITLES, words.NetName),
        (SAM_CLASSES, words.SamFamily),
        (MODEL_TYPES, words.SamFamily),
    ],
)
def test_what_a_word_is_looked_up_in_has_every_word_and_no_other(
    looked_up: Collection[str], word: Any
):
    assert set(looked_up) == set(get_args(word))


def test_states_that_are_finished_are_states_of_a_review():
    assert words.FINISHED < set(words.REVIEW_STATES)


def test_the_words_import_nothing_of_weight():
    code = (
        "import sys, reviewer.words;"
        "found = {'numpy', 'torch', 'cv2', 'reviewer.records'} & set(sys.modules);"
        "assert not found, found"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
