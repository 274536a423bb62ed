"""The page of the HTTP API, written from its OpenAPI document: Markdown, and HTML of the same.

`docs/generate.py` keeps the Markdown as docs/api.md; the gateway serves the HTML at /api/docs. The
HTML has no script and loads nothing but the stylesheet in `static/`, so it works offline and under
the policy of every other page.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from html import escape
from itertools import pairwise
from pathlib import Path
from typing import Any

from markdown_it import MarkdownIt

Json = Mapping[str, Any]
HEAD = """# HTTP API

Generated from the server's own OpenAPI document. A running server shows this page at `/api/docs`,
and the document with all bounds and patterns at `/api/openapi.json`.

A script sends the server's token with every request, and the name under which its changes are kept:

```bash
curl -H "Authorization: Bearer $TOKEN" -H "X-Annotator: my-script" \\
  http://localhost:8000/api/pairs/1/mask > mask.png
```

Ids are those of the database. Masks travel as COCO run-lengths, or as PNG where that is named.
"""


def write_api_page(spec: Json) -> str:
    """Return the Markdown page of an OpenAPI document."""
    operations = [
        (f"{method.upper()} {path}", operation)
        for path, methods in sorted(spec["paths"].items())
        for method, operation in methods.items()
    ]
    parts = [HEAD, *_problems([operation for _, operation in operations]), "## Endpoints", ""]
    for title, operation in operations:
        parts += [f"### {title}", "", operation.get("description", ""), ""]
        parts += _parameters(operation.get("parameters", []))
        if "requestBody" in operation:
            parts += ["Body:", "", *_contents(operation["requestBody"]["content"]), ""]
        for status, answer in operation["responses"].items():
            if status.startswith("2"):
                parts += [f"Answer {status}:", "", *_contents(answer.get("content", {})), ""]
    parts += ["## Records", ""]
    models = {model["title"]: model for model in _models(spec)}
    for name in sorted(models):
        parts += [
            f"### {name}",
            "",
            models[name].get("description", ""),
            "",
            *_fields(models[name]),
        ]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(parts)).rstrip() + "\n"


def render_api_page(spec: Json, template: Path) -> str:
    """Return the HTML page of an OpenAPI document: a template's `{{links}}` and `{{body}}`."""
    markdown = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = markdown.parse(write_api_page(spec))
    links = []
    for opening, inline in pairwise(tokens):
        if opening.type == "heading_open" and opening.tag != "h1":
            anchor = _anchor(inline.content)
            opening.attrSet("id", anchor)
            kind = ' class="part"' if opening.tag == "h2" else ""
            links.append(f'<a href="#{anchor}"{kind}>{escape(inline.content)}</a>')
    body = markdown.renderer.render(tokens, markdown.options, {})
    page = template.read_text(encoding="utf-8")
    return page.replace("{{links}}", "\n".join(links)).replace("{{body}}", body)


def _anchor(heading: str) -> str:
    """Return the anchor that GitHub and MkDocs give a heading, so links hold on every page."""
    return re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", heading).strip().lower())


def _problems(operations: list[Json]) -> list[str]:
    """Return the table of errors; every endpoint answers them in the same form."""
    told = {
        status: answer["description"]
        for operation in operations
        for status, answer in operation["responses"].items()
        if not status.startswith("2")
    }
    rows = [f"| {status} | {told[status]} |" for status in sorted(told)]
    intro = "Every endpoint answers errors as `application/problem+json`, a [Problem](#problem):"
    return ["## Errors", "", intro, "", "| status | meaning |", "|---|---|", *rows, ""]


def _parameters(parameters: list[Json]) -> list[str]:
    rows = [
        f"| `{each['name']}` | {each['in']} | {_kind(each['schema'])} |"
        f" {_needed(each['schema'], each.get('required', False))} |"
        for each in parameters
    ]
    return ["| parameter | in | type | default |", "|---|---|---|---|", *rows, ""] if rows else []


def _contents(contents: Json) -> list[str]:
    if not contents:
        return ["- nothing"]
    return [
        f"- `{kind}`: {_kind(each['schema']) if 'schema' in each else 'bytes'}"
        for kind, each in contents.items()
    ]


def _fields(model: Json) -> list[str]:
    needed = model.get("required", [])
    rows = [
        f"| `{name}` | {_kind(schema)} | {_needed(schema, name in needed)} |"
        for name, schema in model["properties"].items()
    ]
    return ["| field | type | default |", "|---|---|---|", *rows, ""]


def _needed(schema: Json, required: bool) -> str:
    if required:
        return "required"
    return f"`{schema['default']}`" if schema.get("default") not in (None, "") else "none"


def _kind(schema: Json) -> str:
    """Return a schema's type in words, without its bounds."""
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return f"[{name}](#{_anchor(name)})"
    if "properties" in schema:
        return f"[{schema['title']}](#{_anchor(schema['title'])})"
    if "anyOf" in schema:
        return " or ".join(_kind(each) for each in schema["anyOf"])
    if "enum" in schema:
        return ", ".join(f"`{value}`" for value in schema["enum"])
    if "prefixItems" in schema:
        return f"[{', '.join(_kind(each) for each in schema['prefixItems'])}]"
    if schema.get("type") == "array":
        return f"list of {_kind(schema['items'])}"
    if isinstance(schema.get("additionalProperties"), Mapping):
        return f"object of {_kind(schema['additionalProperties'])}"
    return "bytes" if schema.get("format") == "binary" else str(schema.get("type", "anything"))


def _models(node: Any) -> Iterator[Json]:
    """Yield every record of a document, those written in place too."""
    if isinstance(node, Mapping):
        if "properties" in node and isinstance(node.get("title"), str):
            yield node
        for inner in node.values():
            yield from _models(inner)
    elif isinstance(node, list):
        for inner in node:
            yield from _models(inner)
