"""Finishing a pair, whichever way, goes on to the next; and a rightly empty pair has no scores."""

import pytest
from playwright.sync_api import expect
from workbench import on_live, wait_saved, wait_title

from reviewer.evaluation.counting import refresh_counts
from reviewer.store.reviews import annotator_id, review_state

pytestmark = pytest.mark.browser


@pytest.fixture
def desk(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    frame.locator(".pane canvas").first.hover()
    return page, frame


def state(server, pair):
    return review_state(server.store, pair, annotator_id(server.store, "Ada"))


@pytest.mark.parametrize(("key", "expected"), [("a", "approved"), ("0", "confirmed_empty")])
def test_approving_and_confirming_empty_move_on_like_enter(server, desk, key, expected):
    page, frame = desk
    page.keyboard.press(key)
    wait_title(frame, "cs1/0001")
    assert state(server, 1) == expected and state(server, 2) == "todo"
    # A polygon in the air is finished by Enter alone: it is part of what is approved.
    on_live(frame, page, [(20, 90), (60, 90)])
    page.keyboard.press(key)
    wait_title(frame, "cs1/0002")
    assert state(server, 2) == expected


def test_confirming_empty_shows_the_disagreements_of_a_blind_pair_first(server, desk):
    page, frame = desk
    frame.select_option("#mode", "blind")
    page.keyboard.press("0")
    expect(frame.locator("#notice")).to_contain_text("1 disagreement with the prediction")
    wait_title(frame, "cs1/0000")
    page.keyboard.press("0")
    wait_title(frame, "cs1/0001")


def test_a_rightly_empty_pair_has_a_dash_for_its_scores(server, desk):
    page, frame = desk
    refresh_counts(server.store)
    row = frame.locator('#scores tr[data-method="doi"] td')
    for title in ("cs1/0001", "cs1/0002"):
        page.keyboard.press("ArrowRight")
        wait_title(frame, title)
    expect(row).to_have_text(["with DoI", "–", "–", "–"])
    # What is wrongly called unchanged has scores: they are 0, and no dash.
    on_live(frame, page, [(20, 90), (60, 90)])
    wait_saved(frame, 2)
    page.keyboard.press("a")
    expect(frame.locator("#state")).to_have_text("approved")
    page.keyboard.press("ArrowLeft")
    wait_title(frame, "cs1/0001")
    page.keyboard.press("ArrowRight")
    wait_title(frame, "cs1/0002")
    expect(row).to_have_text(["with DoI", "0.000", "0.000", "0.000"])
