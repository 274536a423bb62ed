"""Sweeps over HTTP."""


def test_what_was_swept_comes_with_the_pair_and_for_the_person_alone(client, tiny_split):
    assert client.get("/api/pairs/1").json()["sweep"] == {"columns": 4, "rows": 3, "swept": []}
    reply = client.put("/api/pairs/1/sweep", json={"tile": 5})
    assert reply.json() == {"columns": 4, "rows": 3, "swept": [5]}
    assert client.get("/api/pairs/1").json()["sweep"]["swept"] == [5]
    other = client.get("/api/pairs/1", headers={"X-Annotator": "Bob"})
    assert other.json()["sweep"]["swept"] == []


def test_a_tile_that_is_none_and_a_pair_that_is_not_there_are_refused(client, tiny_split):
    assert client.put("/api/pairs/1/sweep", json={"tile": 12}).status_code == 422
    assert client.put("/api/pairs/1/sweep", json={"tile": -1}).status_code == 422
    assert client.put("/api/pairs/9/sweep", json={"tile": 0}).status_code == 404
