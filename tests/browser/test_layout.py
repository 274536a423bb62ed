"""The page is the workbench: what is drawn on gets the room, the rest gives way to it."""

import re

import pytest
from playwright.sync_api import expect
from workbench import (
    live_place,
    press_in_menu,
    reload,
    show_layers,
    wait_proposals,
    wait_title,
    widen_drawer,
)

pytestmark = pytest.mark.browser

SHARE = """() => [...document.querySelectorAll(".pane")].map((e) => e.getBoundingClientRect())
    .reduce((sum, { width, height }) => sum + width * height, 0)"""
PIXEL = """([selector, x, y]) => {
    const canvas = document.querySelector(selector);
    return [...canvas.getContext("2d").getImageData(x, y, 1, 1).data];
}"""


@pytest.fixture
def desk(server, visit):
    page, frame = visit("Ada")
    page.set_viewport_size({"width": 1600, "height": 900})
    wait_title(frame, "cs1/0000")
    page.wait_for_timeout(800)
    return page, frame


def shares(page, frame):
    page.wait_for_timeout(600)
    return frame.evaluate(SHARE) / (1600 * 900)


def canvas_box(page):
    return page.locator("canvas[data-engine]").bounding_box()


def layers_of(frame):
    return frame.locator(".pane select").evaluate_all("(all) => all.map((s) => s.value)")


def test_the_panes_get_most_of_the_window_and_more_when_the_drawer_is_shut(desk):
    page, frame = desk
    assert shares(page, frame) >= 0.60
    page.keyboard.press("\\")
    expect(page.locator("[data-dock-region=left]")).to_be_hidden()
    assert shares(page, frame) >= 0.70
    frame.click("#drawer")
    expect(page.locator("[data-dock-region=left]")).to_be_visible()
    assert shares(page, frame) < 0.70


def test_a_drawer_that_was_shut_stays_shut_when_the_person_comes_back(server, desk):
    page, _ = desk
    page.keyboard.press("\\")
    expect(page.locator("[data-dock-region=left]")).to_be_hidden()
    page.reload()
    expect(page.locator("iframe.workbench-frame")).to_be_visible()
    expect(page.locator("[data-dock-region=left]")).to_be_hidden()
    assert page.locator("iframe.workbench-frame").bounding_box()["width"] == 1600


def test_how_wide_the_drawer_is_belongs_to_a_person(server, desk):
    page, _ = desk
    widen_drawer(page, 60)
    page.wait_for_timeout(2500)
    wide = page.locator("[data-dock-region=left]").bounding_box()["width"]
    assert wide > 260

    def sign_in(name):
        page.context.clear_cookies()
        page.evaluate("sessionStorage.clear()")
        page.goto(f"{server.url}/sign-in#token=browser-test-token")
        page.fill("input[name=name]", name)
        page.click("text=Sign in")
        page.wait_for_selector("[data-dock-region=left]")
        page.wait_for_timeout(2500)
        return page.locator("[data-dock-region=left]").bounding_box()["width"]

    assert sign_in("Bob") == 220
    assert sign_in("Ada") == wide


def test_the_map_is_small_at_the_foot_of_the_drawer_and_grows_on_a_click(desk):
    page, _ = desk
    box = canvas_box(page)
    assert (box["width"], box["height"]) == (200, 150)
    assert box["x"] + box["width"] <= 220 and box["y"] + box["height"] <= 900
    page.get_by_role("button", name="Show the map large").click()
    expect(page.locator("iframe.workbench-frame")).to_be_hidden()
    page.wait_for_timeout(500)
    assert canvas_box(page)["width"] > 1200
    page.keyboard.press("Escape")
    expect(page.locator("iframe.workbench-frame")).to_be_visible()
    page.wait_for_timeout(500)
    assert canvas_box(page)["width"] == 200


def test_the_map_stays_large_while_a_plan_is_made(desk):
    page, _ = desk
    page.get_by_role("tab", name="Plan").click()
    page.wait_for_timeout(1000)
    assert canvas_box(page)["width"] > 1200
    page.get_by_role("tab", name="Queue", exact=True).click()
    page.wait_for_timeout(1000)
    assert canvas_box(page)["width"] == 200


def test_a_split_without_a_map_takes_no_room_for_one(server, visit):
    server.store.write(lambda c: c.execute("UPDATE splits SET map_id = NULL"))
    server.store.write(lambda c: c.execute("UPDATE images SET x = NULL, y = NULL, theta = NULL"))
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    expect(page.locator("body")).to_have_attribute("data-map", "none")
    expect(page.get_by_role("button", name="Show the map large")).to_be_hidden()
    region = page.locator("[data-dock-region=left]")
    assert region.evaluate("(e) => getComputedStyle(e).paddingBottom") == "0px"


def test_two_large_panes_stand_over_a_strip_of_the_other_layers(desk):
    page, frame = desk
    assert layers_of(frame) == ["warped", "live"]
    thumb = frame.locator('.thumb[data-layer="prediction"]')
    thumb.hover()
    expect(frame.locator(".pane select").first).to_have_value("prediction")
    page.mouse.move(*live_place(frame, (80, 60)))
    expect(frame.locator(".pane select").first).to_have_value("warped")
    thumb.click()
    expect(thumb).to_have_attribute("aria-pressed", "true")
    page.mouse.move(*live_place(frame, (80, 60)))
    assert layers_of(frame) == ["prediction", "live"]
    # The digit means the pane under the cursor; the pane that has the layer takes this one's.
    page.keyboard.press("Alt+5")
    assert layers_of(frame) == ["live", "prediction"]
    reload(frame)
    assert layers_of(frame) == ["live", "prediction"]


def test_the_strip_hides_what_machines_found_from_who_looks_unprompted(desk):
    page, frame = desk
    for layer in ("detector", "prediction"):
        expect(frame.locator(f'.thumb[data-layer="{layer}"]')).to_be_enabled()
    frame.select_option("#mode", "blind")
    for layer in ("detector", "objects_live", "doi", "prediction", "objects_reference"):
        expect(frame.locator(f'.thumb[data-layer="{layer}"]')).to_be_disabled()
    page.mouse.move(*live_place(frame, (80, 60)))
    page.keyboard.press("Alt+5")
    assert layers_of(frame) == ["warped", "live"]


def test_a_preset_sets_mode_and_panes_and_is_named_as_long_as_they_are_so(desk):
    _, frame = desk
    expect(frame.locator("#preset")).to_have_value("draw")
    frame.select_option("#preset", "audit")
    expect(frame.locator("#walk")).to_contain_text("1 of 2")
    assert layers_of(frame) == ["warped", "live", "detector", "objects_live"]
    frame.locator(".pane select").nth(2).select_option("difference")
    expect(frame.locator("#preset")).to_have_value("")
    frame.select_option("#preset", "draw")
    assert layers_of(frame) == ["warped", "live"]
    expect(frame.locator("#mode")).to_have_value("correct")
    show_layers(frame, ["live", "prediction"])
    expect(frame.locator("#preset")).to_have_value("compare")


def test_the_loupe_shows_the_place_under_the_cursor_six_times_as_large(desk):
    page, frame = desk
    page.mouse.move(*live_place(frame, (62, 50)))
    loupe = frame.locator("#loupe")
    expect(loupe).to_be_hidden()
    page.keyboard.down("z")
    expect(loupe).to_be_visible()
    page.wait_for_timeout(300)
    pair = frame.evaluate(
        """async () => {
            const pixels = async (layer) => {
                const url = performance.getEntriesByType("resource").map((e) => e.name)
                    .find((name) => name.includes(`/layers/${layer}.png`));
                const bitmap = await createImageBitmap(await (await fetch(url)).blob());
                const context = new OffscreenCanvas(160, 120).getContext("2d");
                context.drawImage(bitmap, 0, 0);
                return [...context.getImageData(66, 52, 1, 1).data];
            };
            return [await pixels("warped"), await pixels("live")];
        }"""
    )
    # 4 and 2 pixels of the image away from the cursor, 6 pixels each.
    side = frame.locator("#loupe canvas").first.evaluate("(c) => c.width")
    at = [side // 2 + 4 * 6 + 3, side // 2 + 2 * 6 + 3]
    for place, wanted in enumerate(pair):
        got = frame.evaluate(PIXEL, [f"#loupe canvas:nth-child({place + 1})", *at])
        assert got == pytest.approx(wanted, abs=3)
    page.keyboard.up("z")
    expect(loupe).to_be_hidden()


def test_a_small_picture_tells_where_the_panes_look(desk):
    page, frame = desk
    overview = frame.locator("#overview")
    expect(overview).to_be_hidden()
    page.mouse.move(*live_place(frame, (150, 110)))
    page.mouse.wheel(0, -1500)
    expect(overview).to_be_visible()
    whole, part = overview.bounding_box(), frame.locator("#overview i").bounding_box()
    assert part["x"] > whole["x"] + whole["width"] / 2 and part["width"] < whole["width"] / 2
    page.keyboard.press("f")
    expect(overview).to_be_hidden()


def test_a_new_pair_opens_at_its_first_proposal_where_that_is_set(desk):
    page, frame = desk
    frame.click("#more > summary")
    frame.check("#openAtProposal")
    frame.locator("#title").click()
    page.keyboard.press("ArrowRight")
    wait_title(frame, "cs1/0001")
    expect(frame.locator('#proposal-list li[aria-selected="true"]')).to_have_count(1)
    scale = float(re.match(r"[\d.]+", frame.locator("#panes").get_attribute("data-view"))[0])
    page.keyboard.press("f")
    page.wait_for_timeout(300)
    whole = float(re.match(r"[\d.]+", frame.locator("#panes").get_attribute("data-view"))[0])
    assert scale > 1.5 * whole


def test_one_bar_holds_what_is_always_needed_and_the_tab_is_named_after_the_pair(desk):
    page, frame = desk
    assert frame.locator("header.bar").bounding_box()["height"] == 44
    assert page.title() == "cs1/0000 · reviewer"
    for seen in ("#title", "#state", "#standing", "#mode", "button[data-action=submit]"):
        expect(frame.locator(seen)).to_be_visible()
    for put_away in ("#run", "#pane-count", "button[data-action=approve]", "#cleanup"):
        expect(frame.locator(put_away)).to_be_hidden()
    page.keyboard.press("ArrowRight")
    wait_title(frame, "cs1/0001")
    assert page.title() == "cs1/0001 · reviewer"
    press_in_menu(frame, "approve")
    expect(frame.locator("#more")).not_to_have_attribute("open", "")


def test_the_menu_of_a_person_says_who_else_is_here(visit):
    _, frame = visit("Ada")
    frame.click("#person > summary")
    expect(frame.locator("#annotator")).to_have_text("Ada")
    expect(frame.locator("#here")).to_have_text("Nobody else is here.")
    other, _ = visit("Bob")
    expect(frame.locator("#here")).to_have_text("Also here: Bob")
    other.close()
    expect(frame.locator("#here")).to_have_text("Nobody else is here.")
    expect(frame.locator("#person form button")).to_have_text("Sign out")


def test_verdicts_stay_in_sight_in_a_small_window(server, visit):
    page, frame = visit("Ada")
    page.set_viewport_size({"width": 1280, "height": 720})
    frame.select_option("#mode", "audit")
    expect(frame.locator("#walk")).to_contain_text("1 of 2")
    wait_proposals(frame)
    for button in frame.locator("#decide button").all():
        box = button.bounding_box()
        assert box["height"] >= 40 and box["y"] + box["height"] <= 720
    frame.locator("#decide button[data-verdict=reject]").click()
    expect(frame.locator("#walk")).to_contain_text("2 of 2")
    assert server.store.read().execute("SELECT verdict FROM audits").fetchone()[0] == "reject"
