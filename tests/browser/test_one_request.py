"""Opening a pair asks for its data once."""

import re

import pytest
from playwright.sync_api import expect
from workbench import wait_proposals, wait_title

pytestmark = pytest.mark.browser


@pytest.fixture
def desk(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    frame.locator(".pane canvas").first.hover()
    wait_proposals(frame)
    page.wait_for_timeout(1000)
    return page, frame


def data_of(asked, pair):
    """The requests for a pair's data, its pictures left out."""
    return [u for m, u in asked if m == "GET" and re.search(rf"/pairs/{pair}\b(?!/layers)", u)]


def test_a_pair_is_opened_with_one_request_and_none_is_made_twice(desk):
    page, frame = desk
    asked = []
    page.on("request", lambda request: asked.append((request.method, request.url)))
    page.keyboard.press("ArrowRight")
    wait_title(frame, "cs1/0001")
    wait_proposals(frame)
    page.wait_for_timeout(1000)
    assert len(data_of(asked, 2)) == 1 and "/open?" in data_of(asked, 2)[0]
    gets = [url for method, url in asked if method == "GET"]
    assert len(gets) == len(set(gets))


def test_the_list_is_read_anew_when_another_source_is_chosen(desk):
    page, frame = desk
    page.keyboard.press("ArrowRight")
    wait_title(frame, "cs1/0001")
    wait_proposals(frame)
    frame.select_option("#source", "detector")
    detector = frame.locator('#proposal-list li[data-proposal*="/detector/"]')
    expect(detector).not_to_have_count(0)


def test_a_blind_pair_is_opened_without_what_is_proposed(desk):
    page, frame = desk
    frame.select_option("#mode", "blind")
    asked = []
    page.on("request", lambda request: asked.append((request.method, request.url)))
    frame.locator(".pane canvas").first.hover()
    page.keyboard.press("ArrowRight")
    wait_title(frame, "cs1/0001")
    page.wait_for_timeout(1000)
    assert [("source=" in url) for url in data_of(asked, 2)] == [False]
