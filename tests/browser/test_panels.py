"""Panels of the Viser page beside the queue."""

import json
from pathlib import Path

import pytest
from playwright.sync_api import expect
from workbench import press_in_menu, wait_title

pytestmark = pytest.mark.browser


def test_a_plan_is_drawn_and_downloaded(server, visit):
    server.store.write(lambda c: c.execute("UPDATE regions SET inspect = 1, doi = 0.95"))
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    page.get_by_role("tab", name="Plan").click()
    page.get_by_text("Camera", exact=True).click()
    page.get_by_label("Focal, px").fill("100")
    page.keyboard.press("Enter")
    page.get_by_text("Plan this split").click()
    expect(page.locator("body")).to_contain_text("regions ask for another look")
    with page.expect_download() as download:
        page.get_by_text("geojson").click()
    assert download.value.suggested_filename == "plan-cs1.geojson"
    plan = json.loads(Path(download.value.path()).read_text())
    assert plan["properties"]["split"] == "cs1"
    page.get_by_text("Clear the map").click()
    expect(page.locator("body")).not_to_contain_text("regions ask for another look")


def test_scores_follow_the_protocol_and_the_report_is_downloaded(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    press_in_menu(frame, "scores")
    page.get_by_role("button", name="Count", exact=True).click()
    expect(page.locator("body")).to_contain_text("0 ill-posed pixels are left out")
    table = page.locator("table").last
    pooled = table.inner_text()
    assert "with DoI" in pooled and "cs1" in pooled
    page.get_by_label("Protocol").click()
    page.get_by_role("option", name="mean F of images").click()
    expect(table).not_to_have_text(pooled)
    with page.expect_download() as download:
        page.get_by_text("Report as one HTML page").click()
    text = Path(download.value.path()).read_text()
    assert "F is averaged over images (empty and rightly so: skip)" in text


def test_other_rules_and_both_scopes_are_named(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    press_in_menu(frame, "scores")
    page.get_by_role("button", name="Count", exact=True).click()
    means = page.locator("table").first
    for column in ("without DoI", "with DoI (component)", "with DoI (image)"):
        expect(means).to_contain_text(column)
    page.get_by_role("tab", name="What if").click()
    page.get_by_text("Count what other rules would give").click()
    expect(page.locator("body")).to_contain_text("oracle of scope component")
    expect(page.locator("body")).to_contain_text("0 pairs change sides")
    server.store.write(
        lambda c: c.execute("UPDATE pair_terms SET terms = json_set(terms, '$.objects[0][1]', 9)")
    )
    page.get_by_text("Count what other rules would give").click()
    page.get_by_label("f_b = 0").click()
    page.get_by_role("option", name="reject").click()
    expect(page.locator("body")).to_contain_text("2 pairs change sides")
    page.get_by_label("scope", exact=True).click()
    page.get_by_role("option", name="image").click()
    expect(page.locator("body")).to_contain_text("oracle of scope image")


@pytest.mark.parametrize("width", [1120, 1280, 1680])
def test_nothing_of_the_workbench_is_pushed_out_of_its_frame(server, visit, width):
    page, frame = visit("Ada")
    page.set_viewport_size({"width": width, "height": 800})
    frame.select_option("#mode", "audit")
    expect(frame.locator("#walk")).to_contain_text("1 of")
    assert frame.evaluate("document.body.scrollWidth <= window.innerWidth")
    assert (
        frame.locator("#toolbox").bounding_box()["x"] >= frame.frame_element().bounding_box()["x"]
    )


def test_the_workbench_is_not_loaded_again_when_its_panel_is_hidden_or_moved(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    page.locator(".mantine-Notification-closeButton").first.click(timeout=5000)
    page.wait_for_timeout(1500)
    frame.evaluate("document.body.dataset.same = 'yes'")
    element = page.locator("iframe.workbench-frame")
    before = element.bounding_box()
    press_in_menu(frame, "scores")
    expect(element).to_be_hidden()
    page.get_by_role("tab", name="Workbench").click()
    expect(element).to_be_visible()
    page.wait_for_timeout(1500)
    assert element.bounding_box() == before
    press_in_menu(frame, "what-if")
    expect(element).to_be_hidden()
    # Below the other tabs: both are seen now.
    drag(page, page.get_by_role("tab", name="Workbench"), (900, 870))
    expect(element).to_be_visible()
    page.wait_for_timeout(1500)
    moved = element.bounding_box()
    assert moved["y"] > before["height"] / 2 and moved["height"] > 300
    assert on_top(page, page.get_by_role("tab", name="Scores"))
    assert on_top(page, element)
    assert frame.evaluate("document.body.dataset.same") == "yes"


def drag(page, tab, to):
    """Drag a tab out of its panel, to another place of the page."""
    box = tab.bounding_box()
    page.mouse.move(box["x"] + 20, box["y"] + 8)
    page.mouse.down()
    page.mouse.move(*to, steps=10)
    page.mouse.up()
    page.wait_for_timeout(1500)


def on_top(page, locator):
    """Say whether what is drawn in the middle of an element is that element."""
    return locator.evaluate(
        """(element) => {
            const { x, y, width, height } = element.getBoundingClientRect();
            const found = document.elementFromPoint(x + width / 2, y + height / 2);
            return element === found || element.contains(found);
        }"""
    )
