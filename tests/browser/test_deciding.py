"""Deciding quickly: the rest is rejected at once, and any pair is a few letters away."""

import pytest
from playwright.sync_api import expect
from workbench import wait_proposals, wait_saved, wait_title

from reviewer.store.revisions import list_revisions

pytestmark = pytest.mark.browser


@pytest.fixture
def desk(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    frame.locator(".pane canvas").first.hover()
    wait_proposals(frame)
    return page, frame


def logs(server):
    return [action for r in list_revisions(server.store, 1) for action in r.tool_log]


def test_what_is_left_is_rejected_at_once_and_comes_back_with_undo(server, desk):
    page, frame = desk
    frame.select_option("#source", "all")
    items, rejected = frame.locator("#proposal-list li"), frame.locator("li[data-outcome=reject]")
    expect(items).not_to_have_count(1)
    frame.locator(".pane canvas").first.hover()
    page.keyboard.press("Tab")
    page.keyboard.press("v")
    expect(frame.locator("li[data-outcome=add]")).to_have_count(1)
    page.keyboard.press("Shift+J")
    expect(rejected).to_have_count(items.count() - 1)
    expect(frame.locator("#notice")).to_contain_text("rejected (Ctrl+z takes that back)")
    wait_saved(frame, 3)
    page.keyboard.press("Control+z")
    expect(rejected).to_have_count(0)
    expect(frame.locator("li[data-outcome=add]")).to_have_count(1)
    wait_saved(frame, 4)
    tools = [(action["tool"], action.get("of")) for action in logs(server)]
    assert tools == [("add", None), ("reject", None), ("undo", "reject")]


def test_a_few_letters_go_to_a_pair(desk):
    page, frame = desk
    page.keyboard.press("Control+g")
    found = frame.locator("#jump-list li")
    expect(found).to_have_count(3)
    page.keyboard.type("cs1/2")
    page.keyboard.press("Enter")
    wait_title(frame, "cs1/0002")
    expect(frame.locator("#jump")).not_to_be_visible()
    page.keyboard.press("Control+g")
    page.keyboard.type("nowhere")
    expect(frame.locator("#jump [role=status]")).to_contain_text("No pair has that")
    page.keyboard.press("Enter")
    expect(frame.locator("#jump")).to_be_visible()
    page.keyboard.press("Escape")
    expect(frame.locator("#jump")).not_to_be_visible()
    page.keyboard.press("Control+g")
    page.keyboard.type("0")
    expect(found).to_have_count(3)
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    wait_title(frame, "cs1/0001")
