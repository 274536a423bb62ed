"""One key map for the whole page: keys pressed beside the workbench do what they do in it."""

import pytest
from playwright.sync_api import expect
from workbench import on_live, press_in_menu, wait_saved, wait_title

from reviewer.store.reviews import annotator_id, review_state

pytestmark = pytest.mark.browser

# Every key event that comes to the workbench, noted instead of acted upon.
NOTE = """() => {
    window.noted = [];
    for (const type of ["keydown", "keyup"]) {
        window.addEventListener(type, (event) => {
            const { key, code, ctrlKey, shiftKey, altKey, repeat } = event;
            window.noted.push([type, key, code, ctrlKey, shiftKey, altKey, repeat].join());
            event.preventDefault();
            event.stopImmediatePropagation();
        }, true);
    }
}"""
BOXES = """() => [...document.querySelectorAll("[data-dock-region], [role=tab], .workbench-frame")]
    .map((e) => [...Object.values(e.getBoundingClientRect().toJSON()), e.ariaSelected].join())"""


@pytest.fixture
def desk(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    page.locator(".mantine-Notification-closeButton").first.click(timeout=5000)
    # A pointer that comes to lie over the workbench, as the notice goes, gives it the focus.
    page.mouse.move(5, 5)
    page.wait_for_timeout(1500)
    return page, frame


def row(page):
    return page.locator("[data-dock-region=left] button", has_text="cs1/0002")


def focus_on(page, place):
    """Give the focus to a part of Viser's page; again, where a queue being redrawn let go of it."""
    for _ in range(20):
        if place == "queue row":
            row(page).focus()
        elif place == "map":
            page.locator("canvas").first.evaluate("(c) => { c.tabIndex = -1; c.focus(); }")
        else:
            page.get_by_role("tab", name="Found").focus()
        if page.evaluate("document.activeElement.className !== 'workbench-frame'"):
            return
        page.wait_for_timeout(100)
    raise AssertionError(f"the {place} did not keep the focus")


def press(page, key):
    page.keyboard.press(key.replace(" ", "Space").replace("Ctrl", "Control"))


def test_every_key_comes_to_the_workbench_from_wherever_the_focus_is(desk):
    page, frame = desk
    keys = frame.evaluate("async () => (await import('/static/js/keys.js')).KEYS.map((k) => k.key)")
    frame.evaluate(NOTE)
    take = "window.noted.splice(0)"
    frame.evaluate("window.focus()")
    inside = {}
    for key in keys:
        press(page, key)
        inside[key] = frame.evaluate(take)
    assert all(inside.values())
    before = page.evaluate(BOXES)
    for place in ("queue row", "map", "tab"):
        for key in keys:
            focus_on(page, place)
            press(page, key)
            assert frame.evaluate(take) == inside[key], (place, key)
            assert page.evaluate(BOXES) == before, (place, key)


@pytest.mark.parametrize("place", ["queue row", "map", "tab"])
def test_a_key_pressed_beside_the_workbench_does_the_same_there(server, desk, place):
    page, frame = desk
    before = page.evaluate(BOXES)
    focus_on(page, place)
    page.keyboard.press("e")
    pressed = frame.locator('[data-tool][aria-pressed="true"]')
    expect(pressed).to_have_attribute("data-tool", "eraser")
    focus_on(page, place)
    page.keyboard.press("ArrowRight")
    wait_title(frame, "cs1/0001")
    expect(frame.locator("#proposal-list li")).not_to_have_count(0)
    focus_on(page, place)
    page.keyboard.press("Tab")
    expect(frame.locator('#proposal-list li[aria-selected="true"]')).to_have_count(1)
    focus_on(page, place)
    page.keyboard.press("Enter")
    wait_title(frame, "cs1/0002")
    assert review_state(server.store, 2, annotator_id(server.store, "Ada")) == "submitted"
    assert page.evaluate(BOXES) == before


def test_after_a_click_beside_the_workbench_the_focus_is_in_it_again(desk):
    page, frame = desk
    focused = "document.activeElement.className"

    def is_in_it():
        page.wait_for_timeout(500)
        return page.evaluate(focused) == "workbench-frame"

    row(page).click()
    wait_title(frame, "cs1/0002")
    assert is_in_it()
    page.get_by_role("button", name="Show the map large").click()
    assert not is_in_it()
    page.keyboard.press("Escape")
    assert is_in_it()
    page.get_by_role("tab", name="Progress").click()
    assert is_in_it()
    page.get_by_role("tab", name="Queue", exact=True).click()
    page.get_by_label("State").click()
    page.get_by_role("option", name="to do").click()
    assert is_in_it()
    press_in_menu(frame, "scores")
    assert not is_in_it()
    page.get_by_role("tab", name="Workbench").click()
    assert is_in_it()


def test_a_workbench_that_is_not_seen_gets_no_keys(server, desk):
    page, frame = desk
    press_in_menu(frame, "scores")
    page.wait_for_timeout(500)
    for key in ("e", "a", "0"):
        page.keyboard.press(key)
    page.get_by_role("button", name="Count", exact=True).click()
    page.keyboard.press("Enter")
    page.wait_for_timeout(500)
    assert review_state(server.store, 1, annotator_id(server.store, "Ada")) == "todo"
    pressed = frame.locator('[data-tool][aria-pressed="true"]')
    expect(pressed).to_have_attribute("data-tool", "brush")


def test_text_of_the_page_can_be_selected_and_copied(desk):
    page, _ = desk
    page.get_by_text("in doubt, or failed").click(click_count=3)
    page.wait_for_timeout(500)
    assert "in doubt" in page.evaluate("getSelection().toString()")
    assert page.evaluate("document.activeElement.className !== 'workbench-frame'")


def test_a_press_whose_end_is_lost_does_not_shut_the_workbench(server, desk):
    page, frame = desk
    # A context menu that opens keeps the release of the button for itself.
    row(page).dispatch_event("pointerdown", {"bubbles": True, "button": 2, "buttons": 2})
    on_live(frame, page, [(20, 90), (60, 90)])
    wait_saved(frame, 2)


def test_a_field_that_is_typed_into_keeps_its_keys(desk):
    page, frame = desk
    page.get_by_role("tab", name="Plan").click()
    page.get_by_text("Camera", exact=True).click()
    page.get_by_label("Focal, px").click()
    page.keyboard.press("Control+a")
    page.keyboard.type("12")
    page.keyboard.press("e")
    expect(page.get_by_label("Focal, px")).to_be_focused()
    assert "12" in page.get_by_label("Focal, px").input_value()
    pressed = frame.locator('[data-tool][aria-pressed="true"]')
    expect(pressed).to_have_attribute("data-tool", "brush")


def test_keys_that_the_workbench_has_no_use_for_stay_with_the_page(desk):
    page, _ = desk
    page.evaluate(
        "window.heard = []; document.addEventListener('keydown', (e) => heard.push(e.key))"
    )
    for key in ("Control+j", "PageDown", "b"):
        focus_on(page, "tab")
        page.keyboard.press(key)
    assert [key for key in page.evaluate("heard") if key != "Control"] == ["j", "PageDown"]
