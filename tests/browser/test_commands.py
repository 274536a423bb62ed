"""Finding what can be done: the sheet of keys, the palette; and what a decision leads to."""

import pytest
from playwright.sync_api import expect
from workbench import live_place, wait_proposals, wait_saved, wait_title

pytestmark = pytest.mark.browser


@pytest.fixture
def desk(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    return page, frame


def set_in_menu(frame, setting):
    frame.click("#more > summary")
    frame.check(setting)
    frame.locator("#title").click()


def selected(frame):
    return frame.locator('#proposal-list li[aria-selected="true"]')


def two_proposals(server):
    """Give the first pair's run a second object, so that there is a next proposal."""
    names = [row["name"] for row in server.store.read().execute("PRAGMA table_info(objects)")]
    columns = ", ".join(name for name in names if name != "id")
    server.store.write(
        lambda c: c.execute(
            f"INSERT INTO objects ({columns}) SELECT {columns.replace('number', 'number + 1')}"
            " FROM objects WHERE pair_id = 1 AND side = 'live' LIMIT 1"
        )
    )


def test_the_palette_finds_a_command_by_words_and_does_it(desk):
    page, frame = desk
    page.keyboard.press("Control+k")
    page.keyboard.type("brush larger")
    rows = frame.locator("#palette-list li")
    expect(rows).to_have_count(1)
    expect(rows.first).to_contain_text("]")
    page.keyboard.press("Enter")
    expect(frame.locator("#palette")).to_be_hidden()
    assert float(frame.locator("#radius").input_value()) > 6
    page.keyboard.press("Control+k")
    page.keyboard.type("clean")
    page.keyboard.press("ArrowDown")
    expect(rows.nth(1)).to_have_attribute("aria-selected", "true")
    page.keyboard.press("Escape")
    expect(frame.locator("#palette")).to_be_hidden()
    page.keyboard.press("Control+k")
    page.keyboard.type("theme dark light")
    expect(rows).to_have_count(0)
    page.keyboard.press("Control+a")
    page.keyboard.type("dark or light")
    rows.first.click()
    expect(frame.locator("html")).to_have_attribute("data-theme", "light")


def test_the_sheet_of_keys_fits_and_can_be_searched(desk):
    page, frame = desk
    page.set_viewport_size({"width": 1280, "height": 720})
    page.keyboard.press("?")
    sheet = frame.locator("#help").bounding_box()
    assert sheet["y"] >= 0 and sheet["y"] + sheet["height"] <= 720
    expect(frame.locator("#close-help")).to_be_in_viewport()
    frame.fill("#help-search", "lasso")
    expect(frame.locator("#help-keys div")).to_have_count(2)
    frame.fill("#help-search", "")
    assert frame.locator("#help-keys div").count() > 60


def test_blinking_begins_at_once_and_goes_as_fast_as_is_set(desk):
    page, frame = desk
    page.mouse.move(*live_place(frame, (150, 110)))
    # The square is on the live image only.
    frame.evaluate(
        """() => {
            const canvas = document.querySelectorAll(".pane canvas")[1];
            const context = canvas.getContext("2d");
            window.flips = [];
            let last = "";
            const look = () => {
                const [x, y] = [canvas.width / 2 - 1, canvas.height / 2 - 1];
                const now = [...context.getImageData(x, y, 1, 1).data].join();
                if (now !== last) window.flips.push(performance.now());
                last = now;
                requestAnimationFrame(look);
            };
            look();
        }"""
    )
    page.wait_for_timeout(300)

    def held(milliseconds):
        frame.evaluate("window.flips.length = 0; window.pressedAt = performance.now()")
        page.keyboard.down(" ")
        page.wait_for_timeout(milliseconds)
        page.keyboard.up(" ")
        return frame.evaluate("window.flips.map((at) => at - window.pressedAt)")

    slow = held(900)
    assert slow[0] < 200
    assert slow[1] - slow[0] == pytest.approx(320, abs=120)
    frame.evaluate("document.getElementById('blinkMs').value = 160")
    frame.locator("#blinkMs").dispatch_event("input")
    assert len(held(900)) > len(slow)


def test_after_a_decision_the_next_proposal_is_selected(server, desk):
    page, frame = desk
    two_proposals(server)
    frame.select_option("#source", "object_live")
    expect(frame.locator("#proposal-list li")).to_have_count(2)
    page.keyboard.press("Tab")
    first = selected(frame).get_attribute("data-proposal")
    page.keyboard.press("j")
    expect(selected(frame)).not_to_have_attribute("data-proposal", first)
    expect(frame.locator(f'li[data-proposal="{first}"]')).to_contain_text("rejected")
    wait_saved(frame, 2)
    # The last one stays: nothing comes after it.
    last = selected(frame).get_attribute("data-proposal")
    frame.locator("#decide button[data-way=reject]").click()
    wait_saved(frame, 3)
    expect(selected(frame)).to_have_attribute("data-proposal", last)


def test_the_selection_stays_where_that_is_set(server, desk):
    page, frame = desk
    two_proposals(server)
    frame.click("#more > summary")
    frame.uncheck("#advance")
    frame.locator("#title").click()
    frame.select_option("#source", "object_live")
    expect(frame.locator("#proposal-list li")).to_have_count(2)
    page.keyboard.press("Tab")
    first = selected(frame).get_attribute("data-proposal")
    page.keyboard.press("j")
    wait_saved(frame, 2)
    expect(selected(frame)).to_have_attribute("data-proposal", first)


def test_tab_after_the_last_proposal_opens_the_next_pair_where_that_is_set(desk):
    page, frame = desk
    wait_proposals(frame)
    for _ in range(2):
        page.keyboard.press("Tab")
    wait_title(frame, "cs1/0000")
    set_in_menu(frame, "#tabOn")
    page.keyboard.press("Tab")
    wait_title(frame, "cs1/0001")


def test_a_card_shows_its_place_says_it_plainly_and_explains_its_symbols(desk):
    page, frame = desk
    wait_proposals(frame)
    card = frame.locator("#proposal-list li.region").first
    expect(card.locator(".sentence")).to_contain_text("The object fits better than the detector.")
    for crop in card.locator(".seen canvas").all():
        expect(crop).to_have_attribute(
            "data-drawn", "1 0" if crop == 0 else crop.get_attribute("data-drawn")
        )
        assert (
            crop.evaluate(
                "(c) => new Set(c.getContext('2d').getImageData(0, 0, c.width, c.height).data).size"
            )
            > 10
        )
    expect(card.locator("details.why")).to_be_hidden()
    page.keyboard.press("Tab")
    expect(card.locator("details.why")).to_be_visible()
    expect(card.get_by_text("DoI = f_b")).to_be_hidden()
    card.locator("summary").click()
    expect(card.locator("details.why > div")).to_be_visible()
    for symbol in ("DoI", "f_b", "IoU", "M_o"):
        title = card.locator("abbr", has_text=symbol).first.get_attribute("title")
        assert len(title) > 20


def test_reasons_are_asked_for_in_the_audit_only(desk):
    page, frame = desk
    wait_proposals(frame)
    page.keyboard.press("Tab")
    expect(selected(frame)).to_have_count(1)
    expect(frame.locator("#why")).to_be_hidden()
    frame.select_option("#mode", "audit")
    expect(frame.locator("#walk")).to_contain_text("1 of 2")
    expect(frame.locator("#why")).to_be_visible()
