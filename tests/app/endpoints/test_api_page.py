"""The page of the HTTP API: whole, behind the guard, and without anything from outside."""

from html.parser import HTMLParser

import pytest

from reviewer.app.endpoints.api_page import write_api_page


class Seen(HTMLParser):
    """What a page is made of."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.ids: list[str] = []
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.attributes: set[str] = set()
        self.headings: list[str] = []
        self._in_heading = False
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        self._in_heading = tag == "h3"
        for name, value in attrs:
            self.attributes.add(name)
            if name == "id":
                self.ids.append(value)
            elif name in ("href", "src"):
                (self.links if tag == "a" else self.loaded).append(value)

    def handle_data(self, data):
        if self._in_heading:
            self.headings.append(data)
            self._in_heading = False


@pytest.fixture
def page(client):
    reply = client.get("/api/docs")
    assert reply.status_code == 200
    assert reply.headers["content-type"] == "text/html; charset=utf-8"
    return Seen(reply.text)


def test_the_page_has_every_endpoint_and_every_record(client, page):
    spec = client.get("/api/openapi.json").json()
    endpoints = {
        f"{method.upper()} {path}" for path in spec["paths"] for method in spec["paths"][path]
    }
    assert len(endpoints) > 20
    assert endpoints | set(spec["components"]["schemas"]) <= set(page.headings)
    assert "MaskChange" in page.headings  # written in place, not among the components


def test_the_page_loads_only_files_of_this_server(client, page):
    assert page.loaded == ["/favicon.ico", "/static/api-docs.css"]
    assert all(client.get(path).status_code == 200 for path in page.loaded)
    assert "@import" not in client.get("/static/api-docs.css").text
    assert "url(" not in client.get("/static/api-docs.css").text


def test_the_page_keeps_to_the_content_security_policy(client, page):
    assert "default-src 'self'" in client.get("/api/docs").headers["content-security-policy"]
    assert not page.tags & {"script", "style", "iframe"}
    assert not {name for name in page.attributes if name == "style" or name.startswith("on")}


def test_every_link_of_the_page_has_its_place(page):
    assert len(set(page.ids)) == len(page.ids)
    assert {link for link in page.links if link.startswith("#")} <= {
        f"#{name}" for name in page.ids
    }
    assert all(link.startswith("#") for link in page.links)


def test_a_stranger_does_not_see_the_page(stranger):
    assert stranger.get("/api/docs").status_code == 401
    asked = stranger.get("/api/docs", headers={"Accept": "text/html"})
    assert (asked.status_code, asked.headers["location"]) == (303, "/sign-in")


def test_types_are_written_in_words():
    number = {"type": "number"}
    record = {
        "title": "Box",
        "type": "object",
        "description": "A box.",
        "required": ["xyxy"],
        "properties": {
            "xyxy": {"type": "array", "prefixItems": [number, number]},
            "names": {"type": "array", "items": {"type": "string"}, "default": []},
            "by": {"type": "object", "additionalProperties": number},
            "kind": {"anyOf": [{"enum": ["a", "b"]}, {"type": "null"}]},
            "next": {"$ref": "#/components/schemas/Box"},
            "picture": {"type": "string", "format": "binary"},
        },
    }
    page = write_api_page({"paths": {}, "components": {"schemas": {"Box": record}}})
    for row in (
        "| `xyxy` | [number, number] | required |",
        "| `names` | list of string | `[]` |",
        "| `by` | object of number | none |",
        "| `kind` | `a`, `b` or null | none |",
        "| `next` | [Box](#box) | none |",
        "| `picture` | bytes | none |",
    ):
        assert row in page.splitlines()
