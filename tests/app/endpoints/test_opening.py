"""A pair is opened with one request, and as it is at one moment."""

import numpy as np

from reviewer.masks import encode_rle
from reviewer.store.pairs import pair_of_id
from reviewer.store.reviews import annotator_id
from reviewer.store.revisions import NewRevision, add_revision, newest_revision

SOURCES = ["region", "detector"]


def opened(client, pair=1, **query):
    return client.get(f"/api/pairs/{pair}/open", params={"source": SOURCES, **query})


def test_one_answer_has_what_the_three_have(client, run):
    found = opened(client).json()
    mask = client.get("/api/pairs/1/mask", headers={"Accept": "application/json"})
    assert found == {
        "pair": client.get("/api/pairs/1").json(),
        "mask": mask.json(),
        "proposals": client.get("/api/pairs/1/proposals", params={"source": SOURCES}).json(),
    }
    assert found["pair"]["revision"] == found["mask"]["revision"] == 1 and found["proposals"]


def test_the_proposals_of_another_run_come_when_they_are_asked_for(client, make_named_run, run, db):
    make_named_run(db, "pen")
    query = {"source": ["prediction"], "proposals_of": run.name, "run": "named"}
    found = opened(client, **query).json()
    assert found["pair"]["run"] == "named"
    assert {proposal["run"] for proposal in found["proposals"]} == {run.name}


def test_without_a_run_a_pair_opens_all_the_same(client, tiny_split):
    found = opened(client).json()
    assert found["proposals"] == [] and found["pair"]["run"] is None


def test_what_still_holds_is_not_sent_again(client, run, db):
    first = opened(client)
    tag = {"If-None-Match": first.headers["ETag"]}
    path = "/api/pairs/1/open?source=region&source=detector"
    again = client.get(path, headers=tag)
    assert (again.status_code, again.content) == (304, b"")
    mask = encode_rle(np.zeros((120, 160), bool))
    new = NewRevision(1, mask, 1, None, annotator_id(db, "Bob"), source="edit")
    add_revision(db, new)
    changed = client.get(path, headers=tag)
    assert changed.status_code == 200 and changed.json()["mask"]["revision"] == 2


def test_who_asks_matters_for_what_still_holds(client, run):
    tag = opened(client).headers["ETag"]
    client.put("/api/pairs/1/state", json={"state": "submitted"}, headers={"If-Match": '"1"'})
    bob = {"If-None-Match": tag, "X-Annotator": "Bob"}
    path = "/api/pairs/1/open?source=region&source=detector"
    assert client.get(path, headers=bob).json()["pair"]["state"] == "todo"


def test_a_pair_that_is_not_there_is_told(client, run):
    assert opened(client, 9).status_code == 404
    assert opened(client, source=["guess"]).status_code == 422


def test_reads_of_a_snapshot_see_one_moment(db, tiny_split):
    pair = pair_of_id(db, 1)
    mask = encode_rle(np.ones((120, 160), bool))
    with db.snapshot():
        before = newest_revision(db, pair.id).number
        add_revision(db, NewRevision(1, mask, before, None, annotator_id(db, "Bob"), source="edit"))
        assert newest_revision(db, pair.id).number == before
    assert newest_revision(db, pair.id).number == before + 1
