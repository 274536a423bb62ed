"""The pointing tools' endpoints: what they answer, and what they refuse."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from reviewer.masks import decode_rle, encode_rle, read_rle
from reviewer.store.revisions import list_revisions

SIZE = (120, 160)


def click(http, pair=1, **change):
    body = {"client": "w1", "clicks": [{"x": 60, "y": 50}], **change}
    return http.post(f"/api/pairs/{pair}/click", json=body)


def test_a_click_gives_candidates_and_changes_nothing(client, db, run, segmenter):
    before = len(list_revisions(db, 1))
    reply = click(client)
    assert reply.status_code == 200, reply.text
    body = reply.json()
    assert body["model"] == "fake"
    best = decode_rle(read_rle(*SIZE, body["candidates"][0]["counts"]))
    assert best[50, 60] and best.sum() < 200
    assert body["candidates"][0]["score"] > body["candidates"][1]["score"]
    assert len(list_revisions(db, 1)) == before


def test_an_answer_tells_the_segmenters_own_time(client, run, segmenter):
    predict = segmenter.predict
    segmenter.predict = lambda *given: time.sleep(0.2) or predict(*given)
    body = click(client).json()
    assert body["predict_ms"] >= 200 > body["embed_ms"]


def test_clicks_box_and_previous_reach_the_segmenter(client, run, segmenter):
    held = np.zeros(SIZE, bool)
    held[10:20, 10:20] = True
    previous = {"counts": encode_rle(held).counts, "score": 0.9}
    points = [{"x": 12, "y": 12}, {"x": 90.5, "y": 70.25, "positive": False}]
    reply = click(client, clicks=points, box=[5, 6, 40, 50], previous=previous)
    prompt = segmenter.prompts[0]
    assert [(c.x, c.y, c.positive) for c in prompt.clicks] == [(12, 12, True), (90.5, 70.25, False)]
    assert prompt.box_xyxy == (5, 6, 40, 50) and (prompt.previous == held).all()
    # The candidate so far was better by the segmenter's own score, and obeys the clicks.
    assert reply.json()["candidates"][0]["score"] == 0.9


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"clicks": []}, "give a click or a box"),
        ({"clicks": [{"x": 161, "y": 5}]}, "clicks.0: (161, 5) lies outside the image of 160x120"),
        ({"clicks": [{"x": -1, "y": 5}]}, "clicks.0.x"),
        ({"clicks": [{"x": 1, "y": 5}] * 201}, "clicks"),
        ({"box": [5, 5, 5, 50]}, "box"),
        ({"box": [5, 5, 500, 50]}, "box: (500, 50) lies outside"),
        ({"previous": {"counts": "????", "score": 0.5}}, "run-lengths"),
        ({"previous": {"counts": "", "score": 2}}, "previous.score"),
        ({"client": ""}, "client"),
        ({"picture": "mirror"}, "picture"),
        ({"colour": 1}, "colour"),
    ],
)
def test_a_bad_click_is_refused_by_the_name_of_its_field(client, run, segmenter, change, text):
    reply = click(client, **change)
    assert reply.status_code == 422 and text in reply.json()["detail"]
    assert not segmenter.prompts


def test_not_a_number_is_refused(client, run, segmenter):
    body = '{"client": "w", "clicks": [{"x": NaN, "y": 3}]}'
    kind = {"Content-Type": "application/json"}
    reply = client.post("/api/pairs/1/click", content=body, headers=kind)
    assert reply.status_code == 422 and not segmenter.prompts


def test_clicks_on_what_is_not_there(client, run):
    assert click(client, pair=99).status_code == 404
    assert click(client, run="none").status_code == 404


def test_a_newer_click_takes_the_place_of_one_that_waits(client, run, segmenter):
    segmenter.go_on.clear()
    begun = threading.Event()
    own = segmenter.predict

    def predict(*arguments):
        begun.set()
        return own(*arguments)

    segmenter.predict = predict
    with ThreadPoolExecutor(3) as pool:
        running = pool.submit(click, client, client="other")
        assert begun.wait(10)
        stale = pool.submit(click, client, clicks=[{"x": 1, "y": 1}])
        while stale.running() is False:
            pass
        threading.Event().wait(0.3)
        newer = pool.submit(click, client, clicks=[{"x": 99, "y": 99}])
        reply = stale.result(10)
        assert reply.status_code == 409 and "newer one" in reply.json()["detail"]
        segmenter.go_on.set()
        assert running.result(10).status_code == 200 and newer.result(10).status_code == 200
    assert [prompt.clicks[0].x for prompt in segmenter.prompts] == [60, 99]


def test_a_point_of_the_reference_has_a_place_in_the_live_image(client, run):
    there = client.get("/api/pairs/1/live-point", params={"x": 80, "y": 60}).json()
    assert abs(there["x"] - 80) < 3 and abs(there["y"] - 60) < 3
    assert client.get("/api/pairs/1/live-point", params={"x": "nan", "y": 1}).status_code == 422


def test_a_point_needs_an_alignment(client, tiny_split):
    reply = client.get("/api/pairs/1/live-point", params={"x": 80, "y": 60})
    assert reply.status_code == 404 and "no run aligns" in reply.json()["detail"]


def test_a_path_follows_the_edge_of_what_appeared(client, run):
    query = {"x0": 60, "y0": 40, "x1": 50, "y1": 55}
    points = client.get("/api/pairs/1/edge-path", params=query).json()["points"]
    assert points[0] == [60, 40] and points[-1] == [50, 55]
    near = [abs(x - 50) <= 2 or abs(y - 40) <= 2 for x, y in points]
    assert sum(near) > 0.8 * len(near)


@pytest.mark.parametrize("query", [{"x1": 161}, {"y1": -1}, {"picture": "mirror"}])
def test_a_path_outside_is_refused(client, run, query):
    query = {"x0": 60, "y0": 40, "x1": 50, "y1": 55, **query}
    assert client.get("/api/pairs/1/edge-path", params=query).status_code == 422
