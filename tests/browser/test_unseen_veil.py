"""What a run has not seen is veiled on request, and named where scores and reasons stand."""

import numpy as np
import pytest
from playwright.sync_api import expect
from seeing import hide
from workbench import SIX_LAYERS, reload, show_layers, wait_title

from reviewer.evaluation.counting import refresh_counts

pytestmark = pytest.mark.browser

LEFT = np.arange(160)[None, :].repeat(120, axis=0) < 60
WARPED, LIVE, DETECTOR = 0, 1, 2


@pytest.fixture
def desk(server, visit):
    """Ada at a workbench whose first pair is unseen on the left."""
    run = server.store.read().execute("SELECT id FROM runs").fetchone()["id"]
    hide(server.store, run, 1, LEFT)
    refresh_counts(server.store)
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    frame.wait_for_selector("#panes[data-shown='1']")
    frame.locator(".pane canvas").first.hover()
    return page, frame


def lightness(frame, pane, seen):
    """Mean lightness of a pane over rows 70 to 110, left of column 50 or right of column 110."""
    return look(frame, pane, seen)[0]


def look(frame, pane, seen):
    """Mean and spread of the lightness there."""
    frame.wait_for_timeout(400)
    return frame.evaluate(
        """([pane, seen]) => {
            const canvas = document.querySelectorAll(".pane canvas")[pane];
            const [scale] = document.querySelector("#panes").dataset.view.split(" ").map(Number);
            const ratio = canvas.width / canvas.clientWidth;
            const at = (x, y) => [canvas.width / 2 + (x - 80) * scale * ratio,
                canvas.height / 2 + (y - 60) * scale * ratio];
            const [x0, y0] = at(seen ? 110 : 10, 70), [x1, y1] = at(seen ? 150 : 50, 110);
            const { data } = canvas.getContext("2d").getImageData(x0, y0, x1 - x0, y1 - y0);
            const light = [];
            for (let k = 0; k < data.length; k += 4) {
                light.push((data[k] + data[k + 1] + data[k + 2]) / 3);
            }
            const meanOf = (values) => values.reduce((sum, v) => sum + v, 0) / values.length;
            const mean = meanOf(light);
            return [mean, meanOf(light.map((value) => Math.abs(value - mean)))];
        }""",
        [pane, seen],
    )


def test_a_key_veils_what_is_unseen_on_live_and_reference(desk):
    page, frame = desk
    panes = (WARPED, LIVE)
    before, seen = ([look(frame, pane, side) for pane in panes] for side in (False, True))
    page.keyboard.press("Shift+U")
    after, still_seen = ([look(frame, pane, side) for pane in panes] for side in (False, True))
    assert still_seen == [pytest.approx(found, abs=0.5) for found in seen]
    assert after[LIVE][0] < 0.75 * before[LIVE][0]
    # The warp is dark there already: the hatch tells that it is veiled.
    assert after[WARPED][1] > before[WARPED][1] + 8
    button = frame.locator("button[data-action=unseen]")
    expect(button).to_have_attribute("aria-pressed", "true")
    # Overlays that are hidden hide the veil as well, and a reload brings it back.
    page.keyboard.down("h")
    assert lightness(frame, LIVE, False) == pytest.approx(before[LIVE][0], abs=0.5)
    page.keyboard.up("h")
    reload(frame)
    frame.wait_for_selector("#panes[data-shown='1']")
    assert lightness(frame, LIVE, False) == pytest.approx(after[LIVE][0], abs=0.5)
    frame.locator(".pane canvas").first.hover()
    page.keyboard.press("Shift+U")
    assert lightness(frame, LIVE, False) == pytest.approx(before[LIVE][0], abs=0.5)


def test_the_raw_reference_has_no_veil_for_it_lies_in_another_frame(desk):
    page, frame = desk
    frame.locator(".pane select").nth(WARPED).select_option("reference")
    before = lightness(frame, WARPED, False)
    page.keyboard.press("Shift+U")
    assert lightness(frame, WARPED, False) == pytest.approx(before, abs=0.5)


def test_unseen_is_a_layer_that_a_pane_can_show(desk):
    _, frame = desk
    show_layers(frame, SIX_LAYERS)
    picker = frame.locator(".pane select").nth(DETECTOR)
    expect(picker.locator("option[value=unseen]")).to_have_text("Unseen")
    picker.select_option("unseen")
    frame.wait_for_selector("#panes[data-shown='1']")
    assert lightness(frame, DETECTOR, False) < 0.75 * lightness(frame, LIVE, False)
    assert lightness(frame, DETECTOR, True) == pytest.approx(lightness(frame, LIVE, True), abs=0.5)


def test_the_share_stands_beside_the_scores_and_in_the_footer(server, desk):
    _, frame = desk
    expect(frame.locator("#facts")).to_contain_text("unseen 38 %")
    expect(frame.locator("#scores")).to_contain_text("unseen, not scored: 37.5 %")
    expect(frame.locator("#scores")).not_to_contain_text("as a whole")
    hide(server.store, 1, 1, np.ones_like(LEFT))
    refresh_counts(server.store)
    reload(frame)
    told = "unseen, not scored: 100.0 %, 1 changed object as a whole"
    expect(frame.locator("#scores")).to_contain_text(told)


def test_a_region_of_which_nothing_can_be_compared_says_so_in_place_of_its_terms(server, desk):
    _, frame = desk
    server.store.write(
        lambda c: c.execute(
            "UPDATE regions SET f_b = 0, iou = 0, doi = 0, choice = 'keep',"
            " reason = 'outside_warp' WHERE pair_id = 1"
        )
    )
    reload(frame)
    region = frame.locator("#proposal-list li.region").first
    expect(region).to_contain_text("Unseen: nothing of it can be compared")
    expect(region).not_to_contain_text("f_b 0")
    expect(region).not_to_contain_text("DoI = f_b")
