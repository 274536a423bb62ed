"""Who only looks writes nothing, so that a full disk or a read-only database can be looked at."""

import sqlite3

import numpy as np
import pytest
from people import draw

from reviewer.editing.commit import MaskEdit
from reviewer.evaluation.counting import refresh_counts
from reviewer.evaluation.outcomes import refresh_terms
from reviewer.masks import encode_rle


@pytest.fixture
def refused(db, monkeypatch):
    """Let the store write nothing more; holds what was asked of it."""
    asked = []

    def submit(work):
        asked.append(work)
        raise sqlite3.OperationalError("database or disk is full")

    return lambda: (monkeypatch.setattr(db, "submit", submit), asked)[1]


def walk(client, **query):
    return client.get("/api/audit-queue", params=query).json()


def gains(client):
    return [(stop["region"], stop["gain_px"]) for stop in walk(client, order="loss")]


def f_if(client):
    return {r["id"]: r["f_if"] for r in client.get("/api/pairs/1").json()["regions"]}


def test_a_store_that_cannot_write_is_looked_at(client, db, run, refused):
    refresh_counts(db)
    asked = refused()
    for path in [
        "me",
        "runs",
        "splits",
        "pairs",
        "pairs/1",
        "pairs/1/mask",
        "pairs/1/revisions",
        "pairs/1/layers/doi.png",
        "pairs/1/layers/ground_truth.png",
        "audit-queue?order=loss",
        "audit-queue?order=disagreement",
        "reasons",
    ]:
        answer = client.get(f"/api/{path}")
        assert answer.status_code == 200, (path, answer.text)
    assert asked == []


def test_what_is_shown_without_storing_is_what_would_be_stored(client, db, run):
    refresh_counts(db)
    seen = f_if(client), gains(client)
    assert any(seen[0].values()) and any(gain for _, gain in seen[1])
    assert refresh_terms(db, run) == 3
    assert (f_if(client), gains(client)) == seen


def test_after_another_mask_the_numbers_are_of_that_one_and_old_ones_are_not_kept(client, db, run):
    refresh_counts(db)
    refresh_terms(db, run)
    before = f_if(client), gains(client)
    draw(db, 1, "Bob", MaskEdit(encode_rle(np.ones((120, 160), bool)), 1))
    drawn = f_if(client), gains(client)
    assert drawn[0] != before[0] and drawn[1] != before[1]
    refresh_terms(db, run)
    assert (f_if(client), gains(client)) == drawn
