"""What one key did, one key takes back: a mask that was replaced, and verdicts among strokes."""

import pytest
from playwright.sync_api import expect
from workbench import on_live, reload, wait_proposals, wait_saved, wait_title

from reviewer.masks import decode_rle
from reviewer.store.regions import load_prediction, load_regions
from reviewer.store.revisions import newest_revision

pytestmark = pytest.mark.browser


@pytest.fixture
def desk(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    frame.locator(".pane canvas").first.hover()
    return page, frame


def mask_now(server):
    return decode_rle(newest_revision(server.store, 1).mask)


def verdicts(server, *pairs):
    run = 1
    return [r.verdict for pair in pairs for r in load_regions(server.store, run, pair)]


def choose_region(page, frame):
    wait_proposals(frame)
    page.keyboard.press("Tab")
    frame.wait_for_selector('.region[aria-selected="true"]')


def test_a_mask_that_the_prediction_replaced_comes_back_by_a_button(server, desk):
    page, frame = desk
    on_live(frame, page, [(20, 90), (60, 90)])
    wait_saved(frame, 2)
    drawn = mask_now(server)
    page.keyboard.press("p")
    wait_saved(frame, 3)
    assert not mask_now(server)[90, 40]
    notice = frame.locator("#notice")
    expect(notice).to_contain_text(f"in place of the mask, which had {drawn.sum()} px")
    notice.get_by_role("button", name="Undo").click()
    wait_saved(frame, 4)
    assert (mask_now(server) == drawn).all()
    expect(notice).not_to_be_visible()


def test_the_button_takes_back_nothing_that_was_drawn_since(server, desk):
    page, frame = desk
    on_live(frame, page, [(20, 90), (60, 90)])
    wait_saved(frame, 2)
    page.keyboard.press("p")
    wait_saved(frame, 3)
    on_live(frame, page, [(20, 20), (60, 20)])
    wait_saved(frame, 4)
    frame.locator("#notice").get_by_role("button", name="Undo").click()
    expect(frame.locator("#notice")).to_contain_text("was drawn since")
    assert mask_now(server)[20, 40] and not mask_now(server)[90, 40]
    page.keyboard.press("p")
    wait_saved(frame, 5)
    page.keyboard.press("p")
    expect(frame.locator("#notice")).to_contain_text("is the prediction already")


def test_a_verdict_among_strokes_is_undone_in_its_turn_after_a_reload_too(server, desk):
    page, frame = desk
    chosen = frame.locator(".region .choice")
    on_live(frame, page, [(20, 90), (60, 90)])
    wait_saved(frame, 2)
    choose_region(page, frame)
    page.keyboard.press("3")
    expect(chosen).to_have_text("keep ✓")
    page.keyboard.press("4")
    expect(chosen).to_have_text("reject ✓")
    page.keyboard.press("f")
    on_live(frame, page, [(20, 20), (60, 20)])
    wait_saved(frame, 3)
    assert mask_now(server)[20, 40]
    reload(frame)
    wait_title(frame, "cs1/0000")
    expect(chosen).to_have_text("reject ✓")
    page.keyboard.press("Control+z")
    wait_saved(frame, 4)
    assert not mask_now(server)[20, 40] and verdicts(server, 1) == ["reject"]
    page.keyboard.press("Control+z")
    expect(chosen).to_have_text("keep ✓")
    assert load_prediction(server.store, 1, 1, "audited").area > 0
    page.keyboard.press("Control+z")
    expect(chosen).to_have_text("adopt")
    assert verdicts(server, 1) == [None]
    assert load_prediction(server.store, 1, 1, "audited") is None
    page.keyboard.press("Control+z")
    wait_saved(frame, 5)
    assert not mask_now(server)[90, 40]
    for number, verdict in ((6, None), (6, "keep"), (6, "reject"), (7, "reject")):
        page.keyboard.press("Control+Shift+z")
        wait_saved(frame, number)
        expect(chosen).to_have_text(f"{verdict} ✓" if verdict else "adopt")
    assert mask_now(server)[[20, 90], 40].all() and verdicts(server, 1) == ["reject"]


def test_a_verdict_that_cannot_be_taken_back_just_now_stays_the_last_thing_done(server, desk):
    page, frame = desk
    choose_region(page, frame)
    page.keyboard.press("4")
    expect(frame.locator(".region .choice")).to_have_text("reject ✓")
    page.context.set_offline(True)
    page.keyboard.press("Control+z")
    expect(frame.locator("#notice")).to_contain_text("server cannot be reached")
    expect(frame.locator(".region .choice")).to_have_text("reject ✓")
    page.context.set_offline(False)
    page.keyboard.press("Control+z")
    expect(frame.locator(".region .choice")).to_have_text("adopt")
    assert verdicts(server, 1) == [None]


def test_the_audit_goes_back_to_the_pair_whose_verdict_is_undone(server, desk):
    page, frame = desk
    frame.select_option("#mode", "audit")
    expect(frame.locator("#walk")).to_have_text("1 of 2")
    first = frame.locator("#title").inner_text()
    page.keyboard.press("4")
    expect(frame.locator("#walk")).to_have_text("2 of 2")
    page.keyboard.press("Control+z")
    expect(frame.locator("#walk")).to_have_text("1 of 2")
    wait_title(frame, first)
    expect(frame.locator('.region[aria-selected="true"] .choice')).to_have_text("adopt")
    assert verdicts(server, 1, 2) == [None, None]
    page.keyboard.press("4")
    expect(frame.locator("#walk")).to_have_text("2 of 2")
    assert sorted(map(str, verdicts(server, 1, 2))) == ["None", "reject"]
    # A stroke on the next pair is what was done last there.
    page.keyboard.press("f")
    on_live(frame, page, [(20, 90), (60, 90)])
    wait_saved(frame, 2)
    page.keyboard.press("Control+z")
    wait_saved(frame, 3)
    expect(frame.locator("#walk")).to_have_text("2 of 2")
    assert sorted(map(str, verdicts(server, 1, 2))) == ["None", "reject"]


def test_a_slow_reading_of_the_pair_does_not_hide_a_verdict_given_since(server, desk):
    page, frame = desk
    choose_region(page, frame)
    held = []

    def hold(route):
        if held:
            route.continue_()
        else:
            held.append((route, route.fetch()))

    page.route("**/api/pairs/1?*", hold)
    on_live(frame, page, [(20, 90), (60, 90)])
    wait_saved(frame, 2)
    while not held:
        page.wait_for_timeout(20)
    page.keyboard.press("4")
    chosen = frame.locator(".region .choice")
    expect(chosen).to_have_text("reject ✓")
    route, response = held[0]
    with page.expect_response("**/api/pairs/1?*"):
        route.fulfill(response=response)
    page.wait_for_timeout(300)
    expect(chosen).to_have_text("reject ✓")
