"""An approval speaks of one revision: the desk says which, by whom, and who has drawn since."""

import pytest
from people import draw
from playwright.sync_api import expect
from workbench import press_in_menu, reload, wait_title

from reviewer.editing.commit import MaskEdit, change_state
from reviewer.masks import empty_rle
from reviewer.store.reviews import annotator_id

pytestmark = pytest.mark.browser
EMPTY = empty_rle(120, 160)


def test_the_desk_says_what_was_approved_and_who_changed_it_since(server, visit):
    change_state(server.store, 1, annotator_id(server.store, "Bob"), "approved", 1)
    page, frame = visit("Ada")
    expect(frame.locator("#standing")).to_have_text("approved r1 by Bob")
    draw(server.store, 1, "Cy", MaskEdit(EMPTY, 1), "in_progress")
    reload(frame)
    expect(frame.locator("#standing")).to_have_text("approved r1 by Bob; changed since by Cy")
    press_in_menu(frame, "approve")
    wait_title(frame, "cs1/0001")
    page.keyboard.press("ArrowLeft")
    wait_title(frame, "cs1/0000")
    expect(frame.locator("#standing")).to_have_text("approved r2 by Ada")


def test_the_queue_shows_the_team_what_waits_for_review(server, visit):
    draw(server.store, 2, "Bob", MaskEdit(EMPTY, 1))
    page, frame = visit("Ada")
    expect(frame.locator("#standing")).to_have_text("imported r1")
    row = page.get_by_role("button", name="cs1/0001")
    expect(row).to_contain_text("to review")
    row.click()
    expect(frame.locator("#standing")).to_have_text("submitted r2 by Bob")
