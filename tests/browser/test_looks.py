"""How the desk looks: contrast in both themes, names and sizes of controls, nothing that jumps."""

import pytest
from contrast import LEAST_CONTRAST
from playwright.sync_api import expect
from workbench import press_in_menu, wait_proposals, wait_title

pytestmark = pytest.mark.browser

CONTROLS = "button, select, input, summary, textarea"
UNNAMED = """(controls) => [...document.querySelectorAll(controls)]
    .filter((e) => {
        const labels = [...(e.labels ?? [])].map((label) => label.textContent).join(" ");
        const text = e.matches("select, input, textarea") ? "" : e.textContent;
        return !/[a-z0-9]/i.test(e.getAttribute("aria-label") ?? (labels || text));
    }).map((e) => e.outerHTML.slice(0, 90))"""
SMALL = """() => [...document.querySelectorAll(
        ".bar :is(button, select, summary), #toolbox button, #strip :is(button, select),"
        + " aside :is(button, select, input), .pane select, #notice button")]
    .filter((e) => e.checkVisibility({ visibilityProperty: true }))
    .map((e) => [e.outerHTML.slice(0, 90), e.getBoundingClientRect()])
    .filter(([, { width, height }]) => width < 40 || height < 40).map(([html]) => html)"""
BOXES = """() => [".bar", "#title", "#state", "#mode", "#toolbox", "#panes", "#strip", "aside",
        ".tabs", "#decide", ".status", ".bar .primary", "#more", "#person"]
    .map((s) => [s, document.querySelector(s).getBoundingClientRect().toJSON()])
    .map(([s, box]) => [s, ...Object.values(box)])"""
SIZES = [(1280, 720), (1600, 900), (2560, 1440)]


@pytest.fixture
def desk(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    page.locator(".mantine-Notification-closeButton").first.click(timeout=5000)
    wait_proposals(frame)
    return page, frame


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_every_text_can_be_read_in_both_themes(desk, theme):
    page, frame = desk
    if theme == "light":
        page.keyboard.press("Shift+L")
    expect(frame.locator("html")).to_have_attribute("data-theme", theme)
    page.keyboard.press("Tab")

    def readable(where, page_or_frame):
        page.wait_for_timeout(500)
        worst = page_or_frame.evaluate(LEAST_CONTRAST)
        assert worst["contrast"] >= 4.5, (where, worst)

    readable("workbench", frame)
    for tab in ("Progress", "Found", "Plan", "Queue"):
        page.get_by_role("tab", name=tab, exact=True).click()
        readable(tab, page)
    frame.select_option("#mode", "audit")
    expect(frame.locator("#walk")).to_contain_text("1 of 2")
    readable("audit", frame)
    for menu in ("#more", "#person"):
        frame.click(f"{menu} > summary")
        readable(menu, frame)
    frame.locator("#title").click()
    for key in ("?", "Control+k"):
        page.keyboard.press(key)
        readable(key, frame)
        page.keyboard.press("Escape")
    for tab in ("what-if", "scores"):
        press_in_menu(frame, tab)
        readable(tab, page)
        page.keyboard.press("Escape")
        expect(page.locator("iframe.workbench-frame")).to_be_visible()


def test_every_control_has_a_name_to_be_read_aloud(desk):
    page, frame = desk
    frame.select_option("#mode", "audit")
    expect(frame.locator("#walk")).to_contain_text("1 of 2")
    page.keyboard.press("t")
    expect(frame.locator("#history-list li")).not_to_have_count(0)
    assert frame.locator(CONTROLS).count() > 100
    assert frame.evaluate(UNNAMED, CONTROLS) == []


def test_every_control_that_is_always_there_is_large_enough_for_a_finger(desk):
    _, frame = desk
    assert frame.evaluate(SMALL) == []
    frame.select_option("#mode", "audit")
    expect(frame.locator("#walk")).to_contain_text("1 of 2")
    assert frame.evaluate(SMALL) == []
    frame.click("#more > summary")
    assert frame.evaluate(SMALL) == []


def test_what_has_the_focus_is_seen(desk):
    page, frame = desk
    page.keyboard.press("F6")
    for _ in range(8):
        page.keyboard.press("Tab")
        outline = frame.evaluate(
            "(({ outlineStyle, outlineWidth }) => [outlineStyle, outlineWidth])"
            "(getComputedStyle(document.activeElement))"
        )
        assert outline == ["solid", "2px"]


@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
def test_nothing_jumps_from_one_mode_to_another(desk, size):
    page, frame = desk
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.wait_for_timeout(800)
    before = frame.evaluate(BOXES)
    assert all(box[2] >= 0 and box[3] > 0 for box in before)

    def same():
        page.wait_for_timeout(300)
        return frame.evaluate(BOXES) == before

    page.keyboard.press("Tab")
    assert same()
    for tool in ("k", "c", "b"):
        page.keyboard.press(tool)
        assert same(), tool
    frame.select_option("#mode", "audit")
    expect(frame.locator("#walk")).to_contain_text("1 of 2")
    assert same(), "audit"
    frame.select_option("#mode", "blind")
    assert same(), "blind"
    page.keyboard.press("Enter")
    expect(frame.locator("#state")).to_have_text("submitted")
    assert same(), "submitted"
    page.keyboard.press("t")
    assert same(), "history"


def test_the_tour_has_five_steps_can_be_skipped_and_comes_only_once(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    # It was skipped when Ada came first.
    page.reload()
    frame = page.wait_for_selector("iframe.workbench-frame").content_frame()
    expect(frame.locator("#title")).to_have_text("cs1/0000")
    page.wait_for_timeout(1500)
    expect(frame.locator("#tour")).to_be_hidden()
    press_in_menu(frame, "tour", "#person")
    for step in range(1, 6):
        expect(frame.locator("#tour-place")).to_have_text(f"{step} of 5")
        box = frame.locator("#tour").bounding_box()
        assert box["x"] >= 0 and box["y"] >= 0 and box["y"] + box["height"] <= 900
        frame.click("#tour-next")
    expect(frame.locator("#tour")).to_be_hidden()
