"""What is suggested hides nothing: pictures keep their pixels under it, masks alone are filled."""

import pytest
from playwright.sync_api import expect
from workbench import live_place, wait_proposals, wait_title

pytestmark = pytest.mark.browser

# The colour that a pane shows in the middle of an image pixel.
COLOUR = """([pane, x, y]) => {
    const canvas = document.querySelectorAll(".pane canvas")[pane];
    const [scale, cx, cy] = document.getElementById("panes").dataset.view.split(" ").map(Number);
    const ratio = canvas.width / canvas.clientWidth;
    const at = [canvas.width / 2 + (x + 0.5 - cx) * scale * ratio,
        canvas.height / 2 + (y + 0.5 - cy) * scale * ratio].map(Math.round);
    return [...canvas.getContext("2d").getImageData(...at, 1, 1).data].slice(0, 3);
}"""


@pytest.fixture
def desk(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    wait_proposals(frame)
    # The mask that is there already would cover the same place.
    frame.locator(".pane canvas").first.hover()
    page.keyboard.press("x")
    page.keyboard.down("Alt")
    page.mouse.move(*live_place(frame, (2, 2)))
    page.mouse.down()
    page.mouse.move(*live_place(frame, (158, 118)), steps=4)
    page.mouse.up()
    page.keyboard.up("Alt")
    expect(frame.locator("#facts")).to_contain_text("mask 0 px")
    return page, frame


def colour(frame, pane, point):
    frame.page.wait_for_timeout(350)
    return frame.evaluate(COLOUR, [pane, *point])


def test_a_selected_proposal_covers_no_pixel_of_a_picture_from_close_by(desk):
    page, frame = desk
    page.keyboard.press("Tab")
    page.mouse.move(*live_place(frame, (150, 110)))
    inside = (60, 50), (51, 41), (50, 50)
    with_it = [colour(frame, pane, point) for pane in (0, 1) for point in inside]
    page.keyboard.down("h")
    without = [colour(frame, pane, point) for pane in (0, 1) for point in inside]
    page.keyboard.up("h")
    assert with_it == without


def test_a_mask_alone_shows_the_proposal_filled(desk):
    page, frame = desk
    frame.locator(".pane select").nth(1).select_option("ground_truth")
    frame.locator(".pane canvas").first.hover()
    assert colour(frame, 1, (60, 50)) == [0, 0, 0]
    page.keyboard.press("Tab")
    assert colour(frame, 1, (60, 50))[1] > 100


def test_a_candidate_is_outlined_on_pictures(desk):
    page, frame = desk
    page.keyboard.press("c")
    page.mouse.click(*live_place(frame, (62, 50)))
    expect(frame.locator("#facts")).to_contain_text("candidate 1 of")
    page.mouse.move(*live_place(frame, (150, 110)))
    shown = colour(frame, 1, (55, 55))
    page.keyboard.press("Escape")
    expect(frame.locator("#facts")).not_to_contain_text("candidate")
    assert shown == colour(frame, 1, (55, 55))
