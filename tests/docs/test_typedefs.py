"""Typedefs of the scripts: what a JSON schema means in JSDoc, and what a page names."""

import importlib.util
import re
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.fixture(scope="module")
def writing():
    spec = importlib.util.spec_from_file_location("typedefs", DOCS / "typedefs.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("schema", "written"),
    [
        ({"type": "integer"}, "number"),
        ({"anyOf": [{"type": "string"}, {"type": "null"}]}, "string | null"),
        ({"const": -1}, "-1"),
        ({"enum": ["adopt", "keep"], "type": "string"}, '"adopt" | "keep"'),
        ({"type": "array", "items": {"$ref": "#/components/schemas/Region"}}, "Region[]"),
        ({"type": "array", "items": {"enum": ["a", "b"]}}, '("a" | "b")[]'),
        (
            {"type": "array", "prefixItems": [{"type": "number"}, {"type": "null"}]},
            "[number, null]",
        ),
        ({"type": "object", "additionalProperties": {"type": "number"}}, "Record<string, number>"),
        ({"type": "object", "additionalProperties": True}, "Record<string, unknown>"),
        ({"title": "Mask", "properties": {"counts": {"type": "string"}}}, "Mask"),
    ],
)
def test_a_schema_becomes_the_type_that_it_means(writing, schema, written):
    assert writing.jsdoc_type(schema) == written


def test_a_schema_that_no_message_had_so_far_is_told(writing):
    with pytest.raises(ValueError, match="has no JSDoc type yet"):
        writing.jsdoc_type({"not": {"type": "string"}})


def test_a_field_that_may_be_left_out_is_optional(writing):
    fields = {"run": {"type": "string"}, "label": {"type": "string"}}
    model = {"title": "Change", "description": "A name.", "properties": fields, "required": ["run"]}
    [written] = writing.typedefs([{"somewhere": [model]}])
    assert written == " * A name.\n * @typedef {{run: string, label?: string}} Change\n"


def test_two_messages_of_one_name_are_refused(writing):
    one = {"title": "Mask", "properties": {"counts": {"type": "string"}}}
    other = {"title": "Mask", "properties": {"counts": {"type": "integer"}}}
    assert len(writing.typedefs([one, dict(one)])) == 1
    with pytest.raises(ValueError, match="Mask: two messages"):
        writing.typedefs([one, other])


def test_the_module_of_the_wire_holds_both_sides_of_the_socket_and_bodies_without_a_model(writing):
    written = writing.wire_module()
    assert "@typedef {Showing | Step | Changed | RunChosen | ThemeChosen} FromFrame" in written
    messages = "{Ready | Open | Ahead | End | Filtered | Here | Mapped | Failed}"
    assert f"@typedef {messages} ToFrame" in written
    # FastAPI does not read this body itself, so the document holds it without a name.
    assert "@typedef {{mask: RleMask, ignore?: string | null," in written


def test_the_page_s_elements_are_listed_with_their_tags(writing, tmp_path):
    page = tmp_path / "page.html"
    page.write_text('<p id="note">a</p><br><input id="size" type="range"><p>b</p>')
    assert '@typedef {{"note": "p", "size": "input"}} PageTags' in writing.page_module(page)


CALL = re.compile(
    r"@returns \{Promise<(?P<type>[^>]+)>\} \*/\n  (?P<name>\w+): "
    r"(?P<work>(?:(?!\n  (?:\w+:|/\*\*)).)*)",
    re.DOTALL,
)


def test_every_call_of_the_workbench_is_typed_as_its_endpoint_answers(writing):
    answers = {}
    for path, methods in writing.openapi()["paths"].items():
        for method, about in methods.items():
            schema = about["responses"]["200"]["content"].get("application/json", {}).get("schema")
            where = f"{method.upper()} {re.sub(r'{.*?}', '{}', path)}"
            answers[where] = writing.jsdoc_type(schema) if schema else None
    script = (DOCS.parent / "static" / "js" / "api.js").read_text()
    calls = list(CALL.finditer(script))
    assert len(calls) == len(re.findall(r"\bcall\([`\"]/api", script)) > 15
    for call in calls:
        [path] = re.findall(r"\bcall\([`\"](/api/[^?`\"]+)", call["work"])
        # A question that may be left out stands behind the place.
        place = re.sub(r"\$\{[\w.]+\}", "{}", path).partition("${")[0]
        method = (re.findall(r'send\("(\w+)"', call["work"]) or ["GET"])[0]
        assert call["type"] == answers[f"{method} {place}"], call["name"]
