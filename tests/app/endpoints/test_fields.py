"""What people type is checked by one rule, wherever it comes in, and the schema tells it."""

import json

import pytest
from people import heard
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

BASE = "http://localhost:8000"
HERE = {"Origin": BASE, "Host": "localhost:8000"}
BAD = ["a\x00b", "\ud800", "a\u202eb", "x" * 5000]


def send(client, method, path, body):
    """Send JSON as it is, with halves of characters and NaN."""
    headers = {"Content-Type": "application/json"}
    return client.request(method, path, content=json.dumps(body), headers=headers)


@pytest.mark.parametrize("text", BAD)
@pytest.mark.parametrize(
    ("method", "path", "body"),
    [("POST", "/api/regions/1/audit", lambda t: {"verdict": "keep", "reason": t}),
     ("POST", "/api/regions/1/audit", lambda t: {"verdict": "keep", "comment": t}),
     ("POST", "/api/pairs/1/click", lambda t: {"client": t, "clicks": [{"x": 1, "y": 1}]}),
     ("POST", "/api/pairs/1/click",
      lambda t: {"client": "w", "run": t, "clicks": [{"x": 1, "y": 1}]}),
     ("PUT", "/api/pairs/1/labels/0", lambda t: {"label": t}),
     ("PUT", "/api/pairs/1/labels/0", lambda t: {"label": "pen", "run": t}),
     ("PUT", "/api/reasons", lambda t: {"reasons": [t]}),
     ("PUT", "/api/reasons", lambda t: {"reasons": [], t: 1})],
)  # fmt: skip
def test_a_text_that_cannot_be_read_is_422_in_a_body(client, run, method, path, body, text):
    reply = send(client, method, path, body(text))
    assert reply.status_code == 422, reply.text
    assert reply.headers["content-type"] == "application/problem+json"


@pytest.mark.parametrize("text", ["a%00b", "%1b", "x" * 5000, "%E2%80%AE"])
@pytest.mark.parametrize(
    "path",
    ["pairs?run=", "pairs?split=", "pairs/1?run=", "pairs/1/layers/live.png?run=",
     "pairs/1/layers/live.png?v=", "pairs/1/proposals?source=region&run=", "audit-queue?run=",
     "pairs/1/live-point?x=1&y=1&run=", "pairs/1/edge-path?x0=1&y0=1&x1=2&y1=2&run="],
)  # fmt: skip
def test_a_text_that_cannot_be_read_is_422_in_a_query(client, run, path, text):
    reply = client.get(f"/api/{path}{text}")
    assert reply.status_code == 422, reply.text


@pytest.mark.parametrize("name", ["a\x7fb", "x" * 81, "\u202eadA", " "])
def test_a_script_whose_name_cannot_be_read_is_told(app, tiny_split, name):
    headers = {"Authorization": "Bearer a-token-for-tests", "X-Annotator": name.encode()}
    client = TestClient(app, base_url=BASE, headers=headers)
    for path in ("me", "pairs", "pairs/1"):
        reply = client.get(f"/api/{path}")
        assert reply.status_code == 422 and "annotator name" in reply.json()["detail"]
    assert client.put("/api/pairs/1/state", json={"state": "in_progress"}).status_code == 422


def test_what_looks_alike_is_one_person(app, db, tiny_split):
    for name in ("Jürgen", "Ju\u0308rgen", " Jürgen "):
        headers = {"Authorization": "Bearer a-token-for-tests", "X-Annotator": name.encode()}
        client = TestClient(app, base_url=BASE, headers=headers)
        assert client.get("/api/me").json()["annotator"] == "Jürgen"
        assert client.put("/api/pairs/1/state", json={"state": "in_progress"}).status_code == 200
    assert db.read().execute("SELECT count(*) FROM annotators").fetchone()[0] == 1


def test_a_comment_keeps_its_lines(client, run):
    change = {"verdict": "agree", "comment": "one\r\ntwo"}
    reply = client.post("/api/regions/1/audit", json=change)
    assert reply.json()["regions"][0]["comment"] == "one\ntwo"


@pytest.mark.parametrize("number", ["NaN", "Infinity", "1e999", "-1e999"])
@pytest.mark.parametrize(
    ("path", "body"),
    [("/api/pairs/1/click", '{"client": "w", "clicks": [{"x": %s, "y": 1}]}'),
     ("/api/pairs/1/click", '{"client": "w", "box": [1, 1, %s, 9]}'),
     ("/api/regions/1/audit", '{"verdict": %s}')],
)  # fmt: skip
def test_a_number_that_is_none_is_422(client, run, path, body, number):
    headers = {"Content-Type": "application/json"}
    reply = client.post(path, content=body % number, headers=headers)
    assert reply.status_code == 422, reply.text


def test_json_that_cannot_be_parsed_is_told(client, run):
    headers = {"Content-Type": "application/json"}
    for body in ("[" * 50_000, "{", b"\xff"):
        reply = client.post("/api/regions/1/audit", content=body, headers=headers)
        assert reply.status_code in (400, 422), reply.text
        assert reply.headers["content-type"] == "application/problem+json"


def test_another_method_is_405_and_names_the_ones_there_are(client, tiny_split):
    reply = client.delete("/api/pairs/1/mask")
    assert reply.status_code == 405
    assert {m.strip() for m in reply.headers["allow"].split(",")} == {"GET", "PUT"}
    assert reply.headers["content-type"] == "application/problem+json"


@pytest.mark.parametrize("frame", ["binary", "huge"])
def test_a_frame_that_is_no_message_closes_the_desk(client, run, frame):
    with client.websocket_connect("/api/desk", headers=HERE) as socket:
        heard(socket)
        if frame == "binary":
            socket.send_bytes(b"\x00\x01")
        else:
            socket.send_text("x" * 200_000)
        with pytest.raises(WebSocketDisconnect) as closed:
            heard(socket)
        assert closed.value.code == {"binary": 1003, "huge": 1009}[frame]


@pytest.mark.parametrize("pair", [0, -1, 2**63, 1e30])
def test_a_desk_is_told_that_a_pair_has_no_such_number(client, run, pair):
    with client.websocket_connect("/api/desk", headers=HERE) as socket:
        heard(socket)
        socket.send_json({"type": "showing", "pair": pair})
        reply = heard(socket)
        assert reply["type"] == "error" and "could not do" not in reply["detail"]


def test_the_interface_tells_its_bounds_and_refusals(client):
    spec = client.get("/api/openapi.json").json()
    for path, methods in spec["paths"].items():
        for method, about in methods.items():
            assert {"400", "401", "403", "413", "421", "422", "503", "507"} <= set(
                about["responses"]
            ), path
            for parameter in about.get("parameters", ()):
                _bounded(parameter["schema"], f"{method} {path} {parameter['name']}")
    for name in ("VerdictChange", "ClickChange", "LabelChange", "Reasons", "StateChange"):
        for field, schema in spec["components"]["schemas"][name]["properties"].items():
            _bounded(schema, f"{name}.{field}")


def _bounded(schema, place):
    """Every string has a length or a list of values, every number two ends, every list a length."""
    for one in schema.get("anyOf", [schema]):
        kind = one.get("type")
        if kind == "string" and not {"enum", "const"} & set(one):
            assert "maxLength" in one, place
        if kind in ("integer", "number"):
            assert {"minimum", "exclusiveMinimum"} & set(one) and "maximum" in one, place
        if kind == "array":
            assert "maxItems" in one, place
            for item in one.get("prefixItems", [one.get("items", {})]):
                _bounded(item, place)
