"""The server goes away and comes back: the desk is as it was, and what was drawn is there."""

import time

import pytest
from playwright.sync_api import expect
from workbench import (
    choose,
    live_place,
    on_live,
    wait_saved,
    wait_title,
    widen_drawer,
    workbench_of,
)

from reviewer.masks import decode_rle
from reviewer.pipeline.runner import prepare_run, run_pipeline
from reviewer.pipeline.settings import PipelineSettings
from reviewer.store.pairs import pair_ids
from reviewer.store.reviews import annotator_id, review_state
from reviewer.store.revisions import list_revisions

pytestmark = pytest.mark.browser

# The masks that wait in the browser to be sent, oldest first.
KEPT = """async () => {
    const [{ name }] = await indexedDB.databases();
    const { Journal } = await import("/static/js/journal.js");
    const journal = await Journal.open(name.replace("reviewer.", ""));
    return (await journal.queue()).map((change) => change.counts);
}"""


def widths(page):
    return page.evaluate(
        "[...document.querySelectorAll('[data-dock-region], iframe.workbench-frame')]"
        ".map((e) => Math.round(e.getBoundingClientRect().width))"
    )


def picture_of(frame):
    """What a person sees of the desk, as far as it is theirs to set."""
    return frame.evaluate(
        """() => {
            const value = (id) => document.getElementById(id).value;
            const panes = [...document.querySelectorAll(".pane select")].map((s) => s.value);
            const { view } = document.getElementById("panes").dataset;
            const title = document.getElementById("title").textContent;
            const place = document.getElementById("where").textContent.match(/\\d+ %/)[0];
            return { title, run: value("run"), mode: value("mode"), panes, view, place };
        }"""
    )


def second_run(server):
    run = prepare_run(
        server.store, "second", PipelineSettings(segmenter="oversegment", detector="difference")
    )
    run_pipeline(server.store, run, pair_ids(server.store))


def back(server, page, name="Ada"):
    """Start the server, and wait until its new desk has been joined and its panels stand."""
    server.start()
    deadline = time.monotonic() + 30
    while not any(desk.annotator == name for desk in server.desks._desks.values()):
        assert time.monotonic() < deadline
        page.wait_for_timeout(200)
    page.wait_for_timeout(3000)


def test_the_desk_comes_back_as_it_was_when_the_server_is_started_again(server, visit):
    second_run(server)
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    page.wait_for_timeout(1500)
    choose(frame, "#run", "first")
    frame.select_option("#mode", "blind")
    choose(frame, "#pane-count", "4")
    page.keyboard.press("ArrowRight")
    wait_title(frame, "cs1/0001")
    widen_drawer(page, 40)
    page.mouse.move(*live_place(frame, (40, 40)))
    page.mouse.wheel(0, -600)
    page.mouse.down(button="middle")
    page.mouse.move(*live_place(frame, (55, 45)), steps=4)
    page.mouse.up(button="middle")
    page.wait_for_timeout(2500)
    before, wide = picture_of(frame), widths(page)
    assert wide[0] == 260
    for _ in range(2):
        server.stop()
        back(server, page)
        frame = workbench_of(page)
        assert (picture_of(frame), widths(page)) == (before, wide)
        assert frame.locator(".pane canvas").first.evaluate("c => document.hasFocus()")
    page.keyboard.press("Enter")
    expect(frame.locator("#state")).to_have_text("submitted")
    ada = annotator_id(server.store, "Ada")
    states = [review_state(server.store, pair, ada) for pair in (1, 2, 3)]
    assert states == ["todo", "submitted", "todo"]


def test_the_page_loaded_again_goes_on_at_the_pair_that_was_open(server, visit):
    second_run(server)
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    page.wait_for_timeout(1500)
    choose(frame, "#run", "first")
    widen_drawer(page, 40)
    page.keyboard.press("ArrowRight")
    wait_title(frame, "cs1/0001")
    page.wait_for_timeout(2500)
    before, wide = picture_of(frame), widths(page)
    assert wide[0] == 260
    server.stop()
    server.start()
    page.reload()
    frame = workbench_of(page)
    wait_title(frame, "cs1/0001")
    page.wait_for_timeout(2500)
    assert (picture_of(frame), widths(page)) == (before, wide)


def test_the_queue_comes_back_with_its_filters(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    page.get_by_label("Order").click()
    page.get_by_role("option", name="highest DoI").click()
    expect(page.get_by_label("Order")).to_have_value("highest DoI")
    # The focus goes back to the workbench after a choice; what opens before that is closed by it.
    page.wait_for_timeout(1500)
    page.get_by_label("My state").click()
    page.get_by_role("option", name="to do").click()
    expect(page.get_by_label("My state")).to_have_value("to do")
    server.stop()
    back(server, page)
    expect(page.get_by_label("My state")).to_have_value("to do")
    expect(page.get_by_label("Order")).to_have_value("highest DoI")
    (desk,) = server.desks._desks.values()
    assert (desk.state, desk.order) == ("todo", "doi")


def test_three_strokes_drawn_while_the_server_is_away_are_there_when_it_is_back(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    on_live(frame, page, [(20, 20), (60, 20)])
    wait_saved(frame, 2)
    server.stop()
    expect(frame.locator("#save")).to_have_attribute("data-status", "offline")
    expect(frame.locator("#away")).to_contain_text("your work is kept here")
    for y in (80, 90, 100):
        on_live(frame, page, [(20, y), (60, y)])
        expect(frame.locator("#save")).to_have_attribute("data-status", "offline")
    drawn = frame.evaluate(KEPT)
    server.start()
    wait_saved(frame, 5)
    expect(frame.locator("#away")).to_be_hidden()
    history = list_revisions(server.store, 1)
    masks = [decode_rle(revision.mask) for revision in history]
    assert [bool(mask[80, 40]) for mask in masks] == [False, False, True, True, True]
    assert [bool(mask[100, 40]) for mask in masks] == [False, False, False, False, True]
    assert [revision.mask.counts for revision in history[2:]] == drawn
    expect(frame.locator("#facts")).to_contain_text(f"mask {masks[-1].sum()} px")


def test_a_stroke_under_way_while_the_server_comes_back_is_finished(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    page.wait_for_timeout(1500)
    server.stop()
    expect(frame.locator("#save")).to_have_attribute("data-status", "offline")
    page.mouse.move(*live_place(frame, (20, 90)))
    page.mouse.down()
    page.mouse.move(*live_place(frame, (50, 90)), steps=5)
    back(server, page)
    page.mouse.move(*live_place(frame, (80, 90)), steps=5)
    page.mouse.up()
    wait_saved(frame, 2)
    assert decode_rle(list_revisions(server.store, 1)[-1].mask)[90, 20:80].all()


def test_a_workbench_older_than_its_server_says_so(server, visit, monkeypatch):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    page.wait_for_timeout(1000)
    server.stop()
    monkeypatch.setattr("reviewer.app.desks.VERSION", "99.0")
    server.start()
    expect(frame.locator("#notice")).to_contain_text("Load the page again", timeout=20_000)
    wait_saved(frame, 1)


def test_who_was_signed_out_is_told_so_and_goes_on_after_signing_in(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    cookies = page.context.cookies()
    page.context.clear_cookies()
    server.stop()
    server.start()
    expect(frame.locator("#away")).to_contain_text("You are signed out", timeout=15_000)
    on_live(frame, page, [(20, 90), (60, 90)])
    expect(frame.locator("#save")).to_have_attribute("data-status", "offline")
    page.context.add_cookies(cookies)
    wait_saved(frame, 2)
    expect(frame.locator("#away")).to_be_hidden()


def test_nothing_is_called_saved_before_it_is_known_to_be(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    server.stop()
    said = frame.evaluate_handle(
        """() => {
            const [said, line] = [[], document.getElementById("save")];
            const note = () => said.push(line.textContent);
            new MutationObserver(note).observe(line, { childList: true });
            return said;
        }"""
    )
    expect(frame.locator("#save")).to_have_attribute("data-status", "offline")
    on_live(frame, page, [(20, 90), (60, 90)])
    page.wait_for_timeout(1500)
    page.mouse.move(*live_place(frame, (100, 90)))
    assert set(said.json_value()) == {"offline"}


def test_the_banner_says_that_the_server_is_away_while_a_pair_waits_for_a_decision(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    page.route("**/mask", lambda route: route.fulfill(status=422))
    on_live(frame, page, [(20, 90), (60, 90)])
    expect(frame.locator("#save")).to_have_attribute("data-status", "refused")
    server.stop()
    expect(frame.locator("#away")).to_be_visible()
    expect(frame.locator("#away")).to_contain_text("The server is away")
    server.start()
    expect(frame.locator("#away")).to_be_hidden(timeout=15_000)
    expect(frame.locator("#save")).to_have_attribute("data-status", "refused")
