"""JSDoc typedefs from what the program knows itself, so that the scripts are checked against it.

`wire_module` writes static/js/wire.js from the OpenAPI document and the messages of the desk's
socket; `page_module` writes static/js/page.js from the elements that workbench.html names.
`docs/generate.py` calls both.
"""

import json
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

WIDTH = 96
PLAIN = {"integer": "number"} | {name: name for name in ("number", "string", "boolean", "null")}


def wire_module() -> str:
    """Return typedefs of all that the server and a workbench say to each other."""
    from pydantic import TypeAdapter

    from reviewer.app.endpoints import frame_messages as frame

    unions = {"FromFrame": frame.FromFrame, "ToFrame": frame.ToFrame}
    schemas = {name: TypeAdapter(union).json_schema() for name, union in unions.items()}
    written = typedefs([openapi(), *schemas.values()])
    written += [_typedef(jsdoc_type(schema), name, "") for name, schema in schemas.items()]
    return _module(
        "What the server and a workbench say to each other, over HTTP and over the desk's socket.",
        written,
    )


def openapi() -> dict[str, Any]:
    """Return the document at /api/openapi.json."""
    from fastapi import FastAPI

    from reviewer.app.endpoints.api import build_api

    app = FastAPI()
    # No endpoint is called: only what they say of themselves is read.
    app.include_router(build_api(None, None))  # type: ignore[arg-type]
    return app.openapi()


def page_module(page: Path) -> str:
    """Return a typedef of the elements that a page names, by their id."""
    ids = _Ids()
    ids.feed(page.read_text())
    fields = [f'"{name}": "{tag}"' for name, tag in sorted(ids.found.items())]
    tags = _typedef(_object(fields), "PageTags", "The tag of each element.")
    return _module(f"The elements that {page.name} names, by their id.", [tags])


def typedefs(documents: list[dict[str, Any]]) -> list[str]:
    """Return a typedef of every message that the documents describe, by name.

    Raises:
        ValueError: when two messages have one name.
    """
    shapes: dict[str, str] = {}
    abouts: dict[str, str] = {}
    for model in _models(documents):
        name, shape = model["title"], _shape(model)
        if shapes.setdefault(name, shape) != shape:
            raise ValueError(f"{name}: two messages have this name, and other fields")
        abouts[name] = model.get("description", "")
    return [_typedef(shapes[name], name, abouts[name]) for name in sorted(shapes)]


def jsdoc_type(schema: dict[str, Any]) -> str:
    """Return the type that a JSON schema means.

    Raises:
        ValueError: when it means something that no message has had so far.
    """
    if "$ref" in schema:
        return str(schema["$ref"].rpartition("/")[2])
    if "properties" in schema:
        return str(schema["title"])
    for several in ("anyOf", "oneOf"):
        if several in schema:
            return " | ".join(jsdoc_type(each) for each in schema[several])
    if "const" in schema:
        return json.dumps(schema["const"])
    if "enum" in schema:
        return " | ".join(json.dumps(value) for value in schema["enum"])
    kind = schema.get("type")
    if kind in PLAIN:
        return PLAIN[kind]
    if kind == "array" and "prefixItems" in schema:
        return f"[{', '.join(jsdoc_type(each) for each in schema['prefixItems'])}]"
    if kind == "array":
        item = jsdoc_type(schema["items"])
        return f"({item})[]" if " | " in item else f"{item}[]"
    if kind == "object":
        values = schema.get("additionalProperties")
        return f"Record<string, {jsdoc_type(values) if isinstance(values, dict) else 'unknown'}>"
    raise ValueError(f"schema {schema}: has no JSDoc type yet; teach it to docs/typedefs.py")


def _models(node: Any) -> Iterator[dict[str, Any]]:
    """Yield every object with named fields, wherever in a document it is described."""
    if isinstance(node, list):
        for item in node:
            yield from _models(item)
    if not isinstance(node, dict):
        return
    if isinstance(node.get("properties"), dict) and isinstance(node.get("title"), str):
        yield node
    for value in node.values():
        yield from _models(value)


def _shape(model: dict[str, Any]) -> str:
    required = model.get("required", [])
    fields = [
        f"{name}{'' if name in required else '?'}: {jsdoc_type(schema)}"
        for name, schema in model["properties"].items()
    ]
    return _object(fields)


def _object(fields: list[str]) -> str:
    """Write fields, several a line."""
    lines = [""]
    for field in fields:
        if lines[-1] and len(lines[-1]) + len(field) > WIDTH:
            lines.append("")
        lines[-1] += f"{field}, "
    return "{" + "\n *   ".join(line.rstrip() for line in lines).removesuffix(",") + "}"


def _typedef(shape: str, name: str, about: str) -> str:
    """Write a typedef, with the first paragraph of what is said about it."""
    first = about.partition("\n\n")[0].replace("\n", "\n * ")
    return "".join(f" * {line}\n" for line in [first, f"@typedef {{{shape}}} {name}"] if line)


def _module(about: str, typedefs: list[str]) -> str:
    head = f"/**\n * {about}\n * Generated by `make docs`.\n */\n"
    return head + "\n" + "\n".join(f"/**\n{each} */" for each in typedefs) + "\n\nexport {};\n"


class _Ids(HTMLParser):
    """Collects which element has which id."""

    def __init__(self) -> None:
        super().__init__()
        self.found: dict[str, str] = {}

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note the id of an element."""
        if name := dict(attrs).get("id"):
            self.found[name] = tag
