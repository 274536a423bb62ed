"""The sweep: tile by tile from close by, and the record of what was looked at."""

import pytest
from playwright.sync_api import expect
from workbench import reload, wait_title

from reviewer.store.pairs import pair_of_id
from reviewer.store.reviews import annotator_id
from reviewer.store.sweeps import sweep_of_pair

pytestmark = pytest.mark.browser


@pytest.fixture
def desk(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    frame.locator(".pane canvas").first.hover()
    return page, frame


def swept(server):
    ada = annotator_id(server.store, "Ada")
    return sweep_of_pair(server.store, pair_of_id(server.store, 1), ada).swept


def scale(frame):
    return float(frame.locator("#panes").get_attribute("data-view").split()[0])


def test_space_with_shift_walks_the_tiles_and_records_those_that_were_looked_at(server, desk):
    page, frame = desk
    said = frame.locator("#sweep")
    whole = scale(frame)
    expect(said).to_have_text("")
    page.keyboard.press("Shift+Space")
    expect(said).to_have_text("swept 0 of 12 tiles")
    expect(said).to_have_text("swept 1 of 12 tiles")
    assert scale(frame) >= 2 * whole
    # One that flies past is not looked at.
    page.keyboard.press("Shift+Space")
    page.keyboard.press("Shift+Space")
    expect(said).to_have_text("swept 2 of 12 tiles")
    assert swept(server) == (0, 2)
    page.keyboard.press("f")
    reload(frame)
    expect(said).to_have_text("swept 2 of 12 tiles")
    frame.locator(".pane canvas").first.hover()
    page.keyboard.press("Shift+Space")
    expect(said).to_have_text("swept 3 of 12 tiles")
    assert swept(server) == (0, 1, 2)


def test_a_tile_is_not_recorded_on_the_pair_that_came_after(server, desk):
    page, frame = desk
    page.keyboard.press("Shift+Space")
    page.keyboard.press("ArrowRight")
    wait_title(frame, "cs1/0001")
    page.wait_for_timeout(600)
    expect(frame.locator("#sweep")).to_have_text("")
    ada = annotator_id(server.store, "Ada")
    assert (
        swept(server) == sweep_of_pair(server.store, pair_of_id(server.store, 2), ada).swept == ()
    )
