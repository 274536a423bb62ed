"""What a run has not seen, as the desk is told it."""

import cv2
import numpy as np
import pytest
from seeing import hide

LEFT = np.arange(160)[None, :].repeat(120, axis=0) < 60


@pytest.fixture
def veil(client, db, run):
    """The unseen layer of the first pair, RGBA, whose left side is unseen."""
    hide(db, run.id, 1, LEFT)
    reply = client.get("/api/pairs/1/layers/unseen.png")
    assert reply.status_code == 200, reply.text
    return cv2.imdecode(np.frombuffer(reply.content, np.uint8), cv2.IMREAD_UNCHANGED)


def test_the_unseen_layer_veils_what_cannot_be_compared_and_nothing_else(veil):
    assert veil.shape == (120, 160, 4)
    assert ((veil[..., 3] > 0) == LEFT).all()
    # A hatch, so that a dark picture does not hide it.
    assert len(np.unique(veil[20:60, 20:50, :3].reshape(-1, 3), axis=0)) > 1


def test_a_pair_tells_whether_it_has_an_unseen_layer(client, run, tiny_split, db):
    assert "unseen" in client.get("/api/pairs/1").json()["layers"]
    db.write(lambda c: c.execute("DELETE FROM alignments"))
    db.write(lambda c: c.execute("DELETE FROM results WHERE stage = 'align'"))
    assert "unseen" not in client.get("/api/pairs/1").json()["layers"]
    reply = client.get("/api/pairs/1/layers/unseen.png")
    assert reply.status_code == 404 and "not aligned in run" in reply.json()["detail"]


def test_the_scores_of_a_pair_tell_the_share_that_is_unseen(client, db, run, tiny_split):
    hide(db, run.id, 1, LEFT | (np.arange(120)[:, None] < 80))
    scores = client.get("/api/pairs/1").json()["scores"]["doi"]
    assert scores["unseen"] == pytest.approx((120 * 60 + 80 * 100) / (120 * 160))
    assert scores["unseen_objects"] == 1
