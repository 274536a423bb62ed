"""Where the panes look, how many there are, and what the status bar says of it."""

import re

import pytest
from playwright.sync_api import expect
from workbench import (
    choose,
    live_place,
    on_live,
    reload,
    show_layers,
    wait_proposals,
    wait_saved,
    wait_title,
)

from reviewer.store.revisions import list_revisions

pytestmark = pytest.mark.browser


@pytest.fixture
def desk(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    return page, frame


def view_of(frame):
    """Return scale, x, y as drawn last, after the frame has had time to draw."""
    frame.page.wait_for_timeout(250)
    return [float(v) for v in frame.locator("#panes").get_attribute("data-view").split()]


def layers_of(frame):
    return frame.locator(".pane select").evaluate_all("(all) => all.map((s) => s.value)")


def wheel(page, frame, by, times=1, point=(40, 40)):
    page.mouse.move(*live_place(frame, point))
    for _ in range(times):
        page.mouse.wheel(0, by)


def pull(page, frame, dx, dy):
    """Pan with the middle button."""
    x, y = live_place(frame, (80, 60))
    page.mouse.move(x, y)
    page.mouse.down(button="middle")
    page.mouse.move(x + dx, y + dy, steps=3)
    page.mouse.up(button="middle")


def test_the_zoom_of_the_status_bar_is_the_zoom_that_is_drawn(desk):
    page, frame = desk

    def agrees():
        scale = view_of(frame)[0]
        said = re.search(r"(\d+) %", frame.locator("#where").inner_text())
        assert int(said[1]) == pytest.approx(100 * scale, abs=0.51)
        return scale

    whole = agrees()
    wheel(page, frame, -300)
    assert agrees() > whole
    page.keyboard.press("f")
    assert agrees() == pytest.approx(whole)
    wait_proposals(frame)
    page.keyboard.press("Tab")
    frame.wait_for_selector('#proposal-list li[aria-selected="true"]')
    assert agrees() > whole
    page.keyboard.press("g")
    agrees()
    reload(frame)
    agrees()
    frame.locator("button[data-action=fit]").click()
    choose(frame, "#pane-count", "1")
    assert agrees() > whole
    page.set_viewport_size({"width": 1200, "height": 700})
    page.wait_for_timeout(500)
    agrees()
    page.keyboard.press("ArrowRight")
    wait_title(frame, "cs1/0001")
    agrees()


def test_the_revision_of_the_status_bar_is_that_of_the_mask_that_is_shown(server, visit):
    (ada_page, ada), (bob_page, bob) = visit("Ada"), visit("Bob")
    facts = ada.locator("#facts")
    on_live(ada, ada_page, [(20, 90), (60, 90)])
    wait_saved(ada, 2)
    ada_page.keyboard.press("t")
    ada.locator("#history-list li").nth(1).click()
    ada.click("text=Restore r1")
    wait_saved(ada, 3)
    on_live(bob, bob_page, [(20, 20), (60, 20)])
    bob.wait_for_selector("#conflict[open]")
    bob.click("#conflict-save")
    expect(bob.locator("#conflict")).to_be_hidden()
    newest = list_revisions(server.store, 1)[-1].number
    wait_saved(bob, newest)
    expect(facts).to_contain_text("revision 3")
    ada_page.keyboard.press("a")
    expect(ada.locator("#notice")).to_contain_text("Somebody saved a newer mask")
    expect(facts).to_contain_text(f"revision {newest} ")
    ada_page.keyboard.press("0")
    wait_title(ada, "cs1/0001")
    ada_page.keyboard.press("ArrowLeft")
    expect(ada.locator("#state")).to_have_text("confirmed empty")
    expect(facts).to_contain_text(f"revision {newest + 1} ")


def test_panes_that_are_closed_come_back_with_their_layers(desk):
    _, frame = desk
    chosen = ["ground_truth", "live", "difference", "objects_reference", "doi", "ignore"]
    show_layers(frame, chosen)
    choose(frame, "#pane-count", "1")
    assert layers_of(frame) == chosen[:1]
    reload(frame)
    choose(frame, "#pane-count", "3")
    choose(frame, "#pane-count", "6")
    assert layers_of(frame) == chosen
    choose(frame, "#pane-count", "8")
    assert layers_of(frame)[:6] == chosen and len(set(layers_of(frame))) == 8


def test_the_picture_cannot_be_lost(desk):
    page, frame = desk
    whole = view_of(frame)[0]
    for dx, dy in ((9000, 9000), (-9000, 0), (0, -9000), (3000, -3000)):
        pull(page, frame, dx, dy)
        _, x, y = view_of(frame)
        assert 0 <= x <= 160 and 0 <= y <= 120
    wheel(page, frame, 600, times=30)
    least, x, y = view_of(frame)
    assert least == pytest.approx(whole / 2) and 0 <= x <= 160 and 0 <= y <= 120
    wheel(page, frame, 600, times=3)
    assert view_of(frame) == pytest.approx([least, x, y], abs=1e-6)
    wheel(page, frame, -600, times=40)
    scale, x, y = view_of(frame)
    assert scale == 48 and 0 <= x <= 160 and 0 <= y <= 120
    page.keyboard.press("f")
    assert view_of(frame) == pytest.approx([whole, 80, 60])


def test_a_place_that_was_kept_from_before_is_clamped_too(desk):
    page, frame = desk
    wheel(page, frame, -300)
    page.wait_for_timeout(400)
    frame.evaluate(
        """() => {
            const place = JSON.parse(sessionStorage.getItem("reviewer.place"));
            place.view = { scale: 0.001, x: -5000, y: 70 };
            sessionStorage.setItem("reviewer.place", JSON.stringify(place));
        }"""
    )
    reload(frame)
    scale, x, y = view_of(frame)
    assert scale > 0.5 and (x, y) == (0, 70)


def test_a_picture_larger_than_any_pane_fits_as_a_whole(desk):
    _, frame = desk
    view = frame.evaluate(
        """async () => {
            const { clamp, fit } = await import("/static/js/geometry.js");
            const [image, pane] = [{ width: 30000, height: 20000 }, { width: 300, height: 200 }];
            return clamp(fit(image, pane), image, pane);
        }"""
    )
    assert view == {"scale": 0.01, "x": 15000, "y": 10000}
