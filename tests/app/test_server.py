"""What a server says before it starts, and what it does with a file that fails it."""

import sqlite3

import pytest
from starlette.testclient import TestClient

from reviewer.app.server import serve_app
from reviewer.errors import Damaged
from reviewer.masks import empty_rle

BASE = "http://localhost:8000"


def put_mask(client, **change):
    mask = empty_rle(120, 160)
    body = {"mask": {"height": 120, "width": 160, "counts": mask.counts}, **change}
    return client.put("/api/pairs/1/mask", json=body, headers={"If-Match": '"1"'})


def serve(path):
    serve_app(path, host="127.0.0.1", port=0, token=None, allow_hosts=[], click="grabcut")


def test_a_damaged_database_is_not_served(db, monkeypatch):
    people = [(f"{k} " + "x" * 70,) for k in range(4000)]
    db.write(lambda c: c.executemany("INSERT INTO annotators VALUES (NULL, ?, 'now')", people))
    path = db.path
    db.close()
    with path.open("r+b") as file:
        file.seek(path.stat().st_size // 2 // 4096 * 4096)
        file.write(b"\xa5" * 4096)
    monkeypatch.setattr("uvicorn.Server.run", lambda *_, **__: pytest.fail("it was served"))
    with pytest.raises(Damaged, match="restore it from a backup"):
        serve(path)


def test_a_full_disk_is_507_and_what_is_there_can_be_read(client, db, tiny_split):
    db.write(lambda c: c.execute("PRAGMA max_page_count = 1"))
    pages = db.write(lambda c: c.execute("PRAGMA page_count").fetchone()[0])
    change = {"reasons": [f"{k} " + "x" * 70 for k in range(40)]}
    replies = [client.put("/api/reasons", json=change)]
    for _ in range(60):
        log = [{"tool": "x" * 8000}]
        replies.append(put_mask(client, tool_log=log))
    full = [reply for reply in replies if reply.status_code == 507]
    assert full and pages > 1, [reply.status_code for reply in replies]
    assert "the disk is full; make room" in full[0].json()["detail"]
    assert "Error" not in full[0].json()["detail"]
    assert client.get("/api/pairs/1/mask").status_code == 200
    db.write(lambda c: c.execute("PRAGMA max_page_count = 100000"))
    assert put_mask(client).status_code == 200


def test_a_database_that_another_program_holds_is_503(client, db, tiny_split):
    db.write(lambda c: c.execute("PRAGMA busy_timeout = 50"))
    other = sqlite3.connect(db.path)
    other.execute("BEGIN IMMEDIATE")
    reply = put_mask(client)
    assert reply.status_code == 503 and "another program" in reply.json()["detail"]
    other.close()


@pytest.mark.parametrize(("number", "status"), [(28, 507), (30, 503), (5, 503)])
def test_a_disk_that_fails_elsewhere_is_told_too(client, tiny_split, monkeypatch, number, status):
    def fail(*_, **__):
        raise OSError(number, "said by the disk", "/data/cache")

    monkeypatch.setattr("reviewer.app.endpoints.api.draw_layer", fail)
    reply = client.get("/api/pairs/1/layers/live.png")
    assert reply.status_code == status
    assert reply.json()["detail"] == "/data/cache: said by the disk"


def test_looking_makes_no_people(app, db, run):
    def people():
        return [row["name"] for row in db.read().execute("SELECT name FROM annotators")]

    before = people()
    paths = ("splits", "pairs", "pairs/1", "audit-queue", "me", "pairs/1/proposals?source=regions")
    for number, path in enumerate(paths):
        headers = {"Authorization": "Bearer a-token-for-tests", "X-Annotator": f"nobody {number}"}
        client = TestClient(app, base_url=BASE, headers=headers)
        assert client.get(f"/api/{path}").status_code in (200, 422)
        origin = {"Origin": BASE, "Host": "localhost:8000"}
        with client.websocket_connect("/api/desk", headers=origin) as socket:
            assert socket.receive_json()["type"] == "ready"
    assert people() == before
    assert client.put("/api/pairs/1/state", json={"state": "in_progress"}).status_code == 200
    assert people() == [*before, f"nobody {len(paths) - 1}"]
