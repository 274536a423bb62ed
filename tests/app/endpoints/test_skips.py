"""Skipping over HTTP: a state of the pair, its doubt, and the way back."""

import pytest

from reviewer.evaluation.counting import refresh_counts


def test_a_pair_is_skipped_shown_so_and_taken_up_again(client, db, run):
    refresh_counts(db)
    before = client.get("/api/pairs/1").json()
    assert (before["skip"], before["doubt"]) == (None, "")
    said = {"run": run.name, "reason": "badly aligned"}
    skipped = client.put("/api/pairs/1/skip", json=said).json()
    assert skipped["state"] == "skipped"
    assert skipped["skip"] == {"annotator": "Ada", "reason": "badly aligned"}
    page = client.get("/api/pairs", params={"state": "skipped"}).json()
    assert [pair["id"] for pair in page["pairs"]] == [1]
    other = client.get("/api/pairs/1", headers={"X-Annotator": "Bob"}).json()
    assert other["state"] == "skipped"
    back = client.put("/api/pairs/1/skip", json={"skipped": False}).json()
    assert back["state"] == "todo" and back["regions"] == before["regions"]


def test_a_skip_of_what_is_not_there_is_refused(client, db, run):
    assert client.put("/api/pairs/99/skip", json={}).status_code == 404
    assert client.put("/api/pairs/1/skip", json={"run": "none"}).status_code == 404
    assert client.put("/api/pairs/1/skip", json={"reason": ""}).status_code == 422
    reply = client.put("/api/pairs/1/state", json={"state": "skipped"})
    assert reply.status_code == 422


@pytest.mark.parametrize(
    ("field", "text"),
    [("reason", "a\x00b"), ("reason", "\u202eb"), ("reason", "x" * 81), ("reason", " "),
     ("run", "a\nb"), ("run", "x" * 401)],
)  # fmt: skip
def test_a_skip_says_nothing_that_cannot_be_read(client, db, run, field, text):
    reply = client.put("/api/pairs/1/skip", json={field: text})
    assert reply.status_code == 422 and f"body.{field}: text" in reply.json()["detail"]
    assert client.get("/api/pairs/1").json()["skip"] is None


def test_the_doubts_of_alignment_and_detection_are_told_together(client, db, run):
    def write(c):
        c.execute("UPDATE alignments SET doubt = 'reaches 9%' WHERE pair_id = 2")
        c.execute("UPDATE detections SET doubt = '20% changed' WHERE pair_id IN (2, 3)")

    db.write(write)
    assert client.get("/api/pairs/2").json()["doubt"] == "reaches 9%; 20% changed"
    queue = client.get("/api/pairs", params={"order": "doubt"}).json()["pairs"]
    assert [(pair["id"], pair["doubt"]) for pair in queue] == [
        (2, "reaches 9%; 20% changed"),
        (3, "20% changed"),
        (1, ""),
    ]
