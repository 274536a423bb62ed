"""The audit over HTTP: walks, verdicts with reasons, second opinions, the list of reasons."""

from reviewer.editing.verdicts import give_verdict
from reviewer.evaluation.counting import refresh_counts
from reviewer.store.reasons import list_reasons
from reviewer.store.reviews import annotator_id


def walk(client, **query):
    return client.get("/api/audit-queue", params=query).json()


def test_a_walk_by_loss_says_what_flipping_gains(client, run):
    found = walk(client, order="loss")
    gains = [stop["gain_px"] for stop in found]
    assert all(gain is not None for gain in gains) and gains == sorted(gains, reverse=True)
    assert client.get("/api/audit-queue", params={"order": "mood"}).status_code == 422
    assert client.get("/api/audit-queue", params={"opinion": "third"}).status_code == 422


def test_a_second_opinion_is_asked_for_what_others_judged(client, db, run):
    region = walk(client)[0]["region"]
    assert walk(client, opinion="second") == []
    give_verdict(db, region, annotator_id(db, "Bob"), "reject")
    (stop,) = walk(client, opinion="second", order="disagreement")
    assert stop["region"] == region and stop["opposed"]
    client.post(f"/api/regions/{region}/audit", json={"verdict": "agree"})
    assert walk(client, opinion="second") == []


def test_a_second_opinion_can_look_without_seeing_the_first(client, db, run):
    region = client.get("/api/pairs/1").json()["regions"][0]["id"]

    def layer(name, judged):
        query = {"judged": judged}
        return client.get(f"/api/pairs/1/layers/{name}.png", params=query).content

    before = {name: layer(name, True) for name in ("doi", "prediction", "detector")}
    give_verdict(db, region, annotator_id(db, "Bob"), "reject")
    for name in ("doi", "prediction"):
        assert layer(name, True) != before[name] == layer(name, False)
    assert layer("detector", False) == before["detector"]


def test_a_verdict_keeps_its_reason_and_comment(client, run):
    region = walk(client)[0]["region"]
    said = {"verdict": "keep", "reason": "bad alignment", "comment": "the shelf moved"}
    pair = client.post(f"/api/regions/{region}/audit", json=said).json()
    (judged,) = [r for r in pair["regions"] if r["id"] == region]
    assert (judged["verdict_reason"], judged["comment"]) == ("bad alignment", "the shelf moved")
    long = {"verdict": "keep", "reason": "x" * 81}
    assert client.post(f"/api/regions/{region}/audit", json=long).status_code == 422


def test_the_list_of_reasons_is_read_and_replaced(client, db, run):
    assert client.get("/api/reasons").json()["reasons"] == list_reasons(db)
    done = client.put("/api/reasons", json={"reasons": [" too  dark", "glass"]})
    assert done.json() == {"reasons": ["too dark", "glass"]}
    twice = client.put("/api/reasons", json={"reasons": ["a", "a"]})
    assert twice.status_code == 422 and "line 2: 'a' is there twice" in twice.json()["detail"]
    assert list_reasons(db) == ["too dark", "glass"]


def test_a_verdict_is_taken_back_and_given_again_by_its_key(client, db, run):
    refresh_counts(db)
    region = walk(client)[0]["region"]
    before = client.get("/api/pairs/1").json()
    given = client.post(f"/api/regions/{region}/audit", json={"verdict": "reject"}).json()
    path = f"/api/audits/{given['audit']}"
    back = client.put(path, json={"stands": False}).json()
    assert (back["regions"], back["scores"]) == (before["regions"], before["scores"])
    again = client.put(path, json={"stands": True}).json()
    assert (again["regions"], again["scores"]) == (given["regions"], given["scores"])
    assert client.put("/api/audits/99", json={"stands": False}).status_code == 404
    other = client.put(path, json={"stands": False}, headers={"X-Annotator": "Bob"})
    assert other.status_code == 409 and "another person's" in other.json()["detail"]
