"""Proposals, the audit queue and single revisions over HTTP."""

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
