"""Proposals, the audit queue and single revisions over HTTP."""

import pytest
from fakes import NamedObjects

from reviewer.masks import decode_rle, read_rle


def test_proposals_come_with_their_pixels(client, run):
    query = {"source": ["region", "detector"]}
    found = client.get("/api/pairs/1/proposals", params=query).json()
    regions = [p for p in found if p["source"] == "region"]
    assert regions and any(p["source"] == "detector" for p in found)
    mask = decode_rle(read_rle(120, 160, regions[0]["counts"]))
    x0, y0, x1, y1 = regions[0]["box_xyxy"]
    assert mask.sum() == regions[0]["area"] == mask[y0:y1, x0:x1].sum()
    assert mask[45:55, 55:70].all()


def test_proposals_of_an_unknown_source_run_or_pair_are_refused(client, run):
    path = "/api/pairs/1/proposals"
    assert client.get(path).status_code == 422
    assert client.get(path, params={"source": "guess"}).status_code == 422
    assert client.get(path, params={"source": "region", "run": "none"}).status_code == 404
    assert client.get("/api/pairs/99/proposals", params={"source": "region"}).status_code == 404


def test_the_audit_queue_holds_what_nobody_judged(client, run):
    queue = client.get("/api/audit-queue").json()
    assert {entry["pair"] for entry in queue} == {1, 2}
    region = queue[0]["region"]
    client.post(f"/api/regions/{region}/audit", json={"verdict": "agree"})
    left = client.get("/api/audit-queue").json()
    assert region not in {entry["region"] for entry in left} and len(left) == len(queue) - 1
    assert client.get("/api/audit-queue", params={"limit": 0}).status_code == 422


def test_without_a_run_there_is_nothing_to_audit(client, tiny_split):
    reply = client.get("/api/audit-queue")
    assert reply.status_code == 404 and "no run yet" in reply.json()["detail"]


def test_one_revision_can_be_read(client, run):
    first = client.get("/api/pairs/1/revisions/1").json()
    newest = client.get("/api/pairs/1/mask", headers={"Accept": "application/json"}).json()
    assert first["mask"] == newest["mask"] and first["revision"] == 1
    assert client.get("/api/pairs/1/revisions/2").status_code == 404


@pytest.fixture
def named(db, tiny_split, make_named_run):
    return make_named_run(db, "pen")


def relabel(client, number, label, pair=1):
    change = {"run": "named", "label": label}
    return client.put(f"/api/pairs/{pair}/labels/{number}", json=change)


def test_an_edited_label_searches_that_pair_again(client, named):
    before = client.get("/api/pairs/1", params={"run": "named"}).json()
    assert before["reads_labels"]
    assert before["labels"] == [
        {
            "number": 0,
            "component": None,
            "raw": "pen",
            "label": "pen",
            "note": "",
            "edited_by": None,
        }
    ]
    other = client.get("/api/pairs/2", params={"run": "named"}).json()
    after = relabel(client, 0, " Red Wallet. ").json()
    assert after["labels"][0]["label"] == "red wallet" and after["labels"][0]["raw"] == "pen"
    assert after["labels"][0]["edited_by"] == "Ada"
    assert {region["label"] for region in after["regions"]} == {"red wallet"}
    assert after["version"] != before["version"]
    assert client.get("/api/pairs/2", params={"run": "named"}).json() == other
    two = relabel(client, 1, "pen").json()
    assert {region["label"] for region in two["regions"]} == {"red wallet", "pen"}
    assert NamedObjects.built == 1


def test_a_label_that_cannot_be_searched_is_kept_and_says_so(client, named):
    reply = relabel(client, 0, "unfindable")
    assert reply.status_code == 422
    assert "is kept, but" in reply.json()["detail"] and "out of order" in reply.json()["detail"]
    pair = client.get("/api/pairs/1", params={"run": "named"}).json()
    assert pair["labels"][0]["label"] == "unfindable"
    assert {region["label"] for region in pair["regions"]} == {"pen"}
    queue = client.get("/api/pairs", params={"run": "named", "order": "doubt"}).json()["pairs"]
    assert queue[0]["id"] == 1 and "search failed: segmenter named" in queue[0]["doubt"]
    assert relabel(client, 0, "cup").json()["regions"][0]["label"] == "cup"
    queue = client.get("/api/pairs", params={"run": "named"}).json()["pairs"]
    assert [entry["doubt"] for entry in queue] == ["", "", ""]


def test_labels_that_are_no_names_or_nowhere_are_refused(client, named):
    assert relabel(client, 0, "x" * 81).status_code == 422
    assert relabel(client, 0, "x" * 4001).status_code == 422
    assert relabel(client, 5, "pen").status_code == 404
    assert relabel(client, 0, "pen", pair=99).status_code == 404


def test_regions_with_a_verdict_are_not_searched_away(client, named):
    region = client.get("/api/pairs/1", params={"run": "named"}).json()["regions"][0]["id"]
    client.post(f"/api/regions/{region}/audit", json={"verdict": "agree"})
    reply = relabel(client, 0, "cup")
    assert reply.status_code == 409 and "another search would replace" in reply.json()["detail"]
    pair = client.get("/api/pairs/1", params={"run": "named"}).json()
    assert pair["labels"][0]["label"] == "pen"


def test_a_bad_alignment_is_flagged_in_the_queue(client, db, run):
    db.write(lambda c: c.execute("UPDATE alignments SET doubt = 'reaches 9%' WHERE pair_id = 2"))
    queue = client.get("/api/pairs", params={"order": "doubt"}).json()["pairs"]
    assert (queue[0]["id"], queue[0]["doubt"]) == (2, "reaches 9%")
    found = client.get("/api/pairs/2").json()["alignment"]
    assert found["doubt"] == "reaches 9%" and found["residual_after"] < found["residual_before"]
    assert found["backward_px"] < 1 and 0.9 < found["valid_fraction"] <= 1
