"""Names of what changed, and the list of what was found, in a real Chromium."""

import pytest
from playwright.sync_api import expect
from workbench import press_in_menu, wait_title

from reviewer.found.listing import list_named_finds
from reviewer.store.layers import load_labels, load_objects

pytestmark = pytest.mark.browser


def test_a_name_is_written_over_and_searched_then_found_under_another(
    server, visit, make_named_run
):
    run = make_named_run(server.store, "pen")
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    expect(frame.locator("#label-use")).to_have_text("searched for on both images")
    field = frame.get_by_label("Name 1 of what changed")
    expect(field).to_have_value("pen")
    field.fill("wallet")
    # Keys belong to the field, not to the tools.
    assert frame.locator("[data-tool=brush]").get_attribute("aria-pressed") == "true"
    field.press("Enter")
    expect(frame.locator("#label-list li").first).to_contain_text("edited by Ada")
    expect(frame.locator("#proposal-list .region").first).to_contain_text("wallet")
    assert [o.label for o in load_objects(server.store, run.id, 1)] == ["wallet"]
    assert load_labels(server.store, run.id, 1)[0].raw == "pen"
    field.fill("unfindable")
    field.press("Enter")
    expect(frame.locator("#notice")).to_contain_text("is kept, but")

    page.get_by_role("tab", name="Found").click()
    names = page.locator("input[value='pen'], input[value='wallet']")
    expect(names).to_have_count(2)
    page.locator("input[value='pen']").fill("fountain pen")
    page.locator("input[value='fountain pen']").press("Enter")
    page.wait_for_timeout(600)
    assert {i.name for i in list_named_finds(server.store, run.id)} == {"fountain pen", "wallet"}
    expect(page.locator("img[src^='/api/found/']")).to_have_count(2)
    assert page.locator("img[src^='/api/found/']").first.evaluate("e => e.naturalWidth") == 176
    page.get_by_role("button", name="Open cs1/0001").click()
    wait_title(frame, "cs1/0001")


def test_another_rule_shows_its_score_and_narrows_the_queue(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    press_in_menu(frame, "what-if")
    page.get_by_role("button", name="Count what other rules would give").click()
    expect(page.get_by_text("0 pairs change sides")).to_be_visible()
    page.locator("input[type=text][value='0.9']").fill("0")
    page.keyboard.press("Enter")
    expect(page.get_by_text("2 pairs change sides")).to_be_visible()
    page.get_by_role("button", name="Queue: the pairs that change sides").click()
    expect(page.get_by_text("pairs that change sides", exact=False).first).to_be_visible()
    expect(page.get_by_role("button", name="cs1/0002")).to_have_count(0)
    page.get_by_role("button", name="Queue: all pairs").click()
    expect(page.get_by_role("button", name="cs1/0002")).to_have_count(1)
