"""The review desk beyond drawing: clicks, proposals, history, modes, keys, touch."""

import re

import numpy as np
import pytest
from playwright.sync_api import expect
from workbench import (
    SIX_LAYERS,
    live_place,
    on_live,
    reload,
    show_layers,
    wait_saved,
    wait_title,
)

from reviewer.masks import decode_rle, intersection_over_union
from reviewer.store.reviews import annotator_id, review_state
from reviewer.store.revisions import list_revisions, newest_revision

pytestmark = pytest.mark.browser


@pytest.fixture
def desk(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    return page, frame


def mask_now(server, pair=1):
    return decode_rle(newest_revision(server.store, pair).mask)


def log_of(server, number, pair=1):
    return list_revisions(server.store, pair)[number - 1].tool_log


def square():
    mask = np.zeros((120, 160), bool)
    mask[40:60, 50:75] = True
    return mask


def empty_the_mask(page, frame):
    """Take the imported square out, so that there is something to find."""
    page.keyboard.press("x")
    page.keyboard.down("Alt")
    on_live(frame, page, [(45, 35), (80, 65)])
    page.keyboard.up("Alt")
    wait_saved(frame, 2)


def test_a_click_finds_the_object_and_enter_takes_it(server, desk):
    page, frame = desk
    empty_the_mask(page, frame)
    page.keyboard.press("c")
    on_live(frame, page, [(62, 50)])
    expect(frame.locator("#facts")).to_contain_text("candidate 1 of")
    assert not mask_now(server).any()
    page.keyboard.press("Enter")
    wait_saved(frame, 3)
    assert intersection_over_union(mask_now(server), square()) > 0.9
    (action,) = log_of(server, 3)
    assert action["tool"] == "click" and action["model"] == "grabcut"
    assert len(action["clicks"]) == 1 and abs(action["clicks"][0][0] - 62) < 1
    page.keyboard.press("Control+z")
    wait_saved(frame, 4)
    assert not mask_now(server).any()


def test_a_click_can_be_given_up_and_leaves_nothing(server, desk):
    page, frame = desk
    page.keyboard.press("c")
    on_live(frame, page, [(120, 100)])
    expect(frame.locator("#facts")).to_contain_text("candidate 1 of")
    page.keyboard.press("Tab")
    page.keyboard.press("Escape")
    expect(frame.locator("#facts")).not_to_contain_text("candidate")
    page.keyboard.press("b")
    on_live(frame, page, [(20, 90)])
    wait_saved(frame, 2)
    assert not mask_now(server)[90:, 100:].any()


def test_a_right_click_takes_away_from_what_is_drawn(server, desk):
    page, frame = desk
    page.keyboard.press("b")
    on_live(frame, page, [(75, 50), (110, 50)])
    wait_saved(frame, 2)
    before = mask_now(server).sum()
    page.keyboard.press("c")
    x, y = live_place(frame, (100, 50))
    page.mouse.click(x, y, button="right")
    expect(frame.locator("#facts")).to_contain_text("candidate 1 of")
    page.keyboard.press("Enter")
    wait_saved(frame, 3)
    assert mask_now(server).sum() < before and not mask_now(server)[50, 100]
    assert mask_now(server)[50, 60]


def test_a_box_is_a_prompt_too_on_the_reference_as_well(server, desk):
    page, frame = desk
    empty_the_mask(page, frame)
    page.keyboard.press("c")
    on_live(frame, page, [(46, 36), (79, 64)])
    expect(frame.locator("#facts")).to_contain_text("candidate 1 of")
    page.keyboard.press("Enter")
    wait_saved(frame, 3)
    assert intersection_over_union(mask_now(server), square()) > 0.9
    assert "box" in log_of(server, 3)[0]
    on_live(frame, page, [(120, 90)], pane=0)
    expect(frame.locator("#facts")).to_contain_text("candidate 1 of")
    page.keyboard.press("u")
    wait_saved(frame, 4)
    assert log_of(server, 4)[0]["picture"] == "reference"
    assert newest_revision(server.store, 1).ignore_mask


def test_the_ill_posed_layer_is_drawn_beside_the_mask(server, desk):
    page, frame = desk
    before = mask_now(server)
    page.keyboard.press("i")
    expect(frame.locator("#target")).to_have_attribute("aria-pressed", "true")
    on_live(frame, page, [(20, 90), (60, 90)])
    wait_saved(frame, 2)
    revision = newest_revision(server.store, 1)
    ignored = decode_rle(revision.ignore_mask)
    assert (decode_rle(revision.mask) == before).all()
    assert ignored[90, 30:50].all() and not ignored[50, 60]
    page.keyboard.press("i")
    on_live(frame, page, [(100, 20)])
    wait_saved(frame, 3)
    assert newest_revision(server.store, 1).ignore_mask == revision.ignore_mask
    for _ in range(2):
        page.keyboard.press("Control+z")
    wait_saved(frame, 5)
    assert newest_revision(server.store, 1).ignore_mask is None


def test_undo_survives_a_reload(server, desk):
    page, frame = desk
    for number, y in enumerate((20, 30, 90), start=2):
        on_live(frame, page, [(20, y), (60, y)])
        wait_saved(frame, number)
    page.keyboard.press("Control+z")
    wait_saved(frame, 5)
    reload(frame)
    wait_title(frame, "cs1/0000")
    expect(frame.locator("#facts")).to_contain_text("revision 5")
    page.keyboard.press("Control+z")
    wait_saved(frame, 6)
    assert mask_now(server)[20, 40] and not mask_now(server)[30, 40]
    for number in (7, 8):
        page.keyboard.press("Control+Shift+z")
        wait_saved(frame, number)
    assert mask_now(server)[[20, 30, 90], 40].all()


def test_undo_of_another_persons_mask_is_not_offered(server, visit):
    (ada_page, ada), (bob_page, bob) = visit("Ada"), visit("Bob")
    wait_title(ada, "cs1/0000")
    on_live(ada, ada_page, [(20, 90), (60, 90)])
    wait_saved(ada, 2)
    reload(bob)
    wait_title(bob, "cs1/0000")
    expect(bob.locator("#facts")).to_contain_text("revision 2")
    on_live(bob, bob_page, [(20, 20), (60, 20)])
    wait_saved(bob, 3)
    reload(ada)
    expect(ada.locator("#facts")).to_contain_text("revision 3")
    before = mask_now(server)
    ada_page.keyboard.press("Control+z")
    on_live(ada, ada_page, [(20, 105), (60, 105)])
    wait_saved(ada, 4)
    # Only the stroke after the undo was saved, and it took nothing of Bob's away.
    assert [action["tool"] for action in log_of(server, 4)] == ["brush"]
    assert mask_now(server)[before].all()


def test_proposals_of_every_source_are_walked_and_applied(server, desk):
    page, frame = desk
    sources = {"region": "region", "detector": "detector", "object_live": "object_live"}
    for source, name in {**sources, "run:first": "prediction"}.items():
        frame.select_option("#source", source)
        expect(frame.locator(f'#proposal-list li[data-proposal*="/{name}/"]')).not_to_have_count(0)
        page.keyboard.press("Tab")
        expect(frame.locator('#proposal-list li[aria-selected="true"]')).to_have_count(1)
    key = frame.locator('#proposal-list li[aria-selected="true"]').get_attribute("data-proposal")
    page.keyboard.press("d")
    wait_saved(frame, 2)
    assert not mask_now(server)[42:58, 52:72].any()
    page.keyboard.press("j")
    expect(frame.locator("#proposal-list li")).to_contain_text("rejected")
    wait_saved(frame, 3)
    assert [log_of(server, n) for n in (2, 3)] == [
        ({"tool": "subtract", "proposal": key},),
        ({"tool": "reject", "proposal": key},),
    ]
    page.keyboard.press("u")
    wait_saved(frame, 4)
    assert newest_revision(server.store, 1).ignore_mask
    reload(frame)
    expect(frame.locator("#proposal-list li .outcome")).to_have_text("ill-posed")


def test_any_revision_can_be_looked_at_and_restored(server, desk):
    page, frame = desk
    page.keyboard.press("i")
    on_live(frame, page, [(20, 20), (40, 20)])
    wait_saved(frame, 2)
    page.keyboard.press("i")
    on_live(frame, page, [(20, 90), (60, 90)])
    wait_saved(frame, 3)
    page.keyboard.press("t")
    rows = frame.locator("#history-list li")
    expect(rows).to_have_count(3)
    expect(rows.first).to_contain_text("r3")
    expect(rows.first).to_contain_text("brush")
    rows.nth(2).click()
    frame.click("text=Restore r1")
    wait_saved(frame, 5)
    history = list_revisions(server.store, 1)
    assert history[-1].mask == history[0].mask and history[-1].ignore_mask is None
    assert history[-1].tool_log == ({"tool": "restore", "revision": 1},)
    for _ in range(2):
        page.keyboard.press("Control+z")
    wait_saved(frame, 7)
    newest = newest_revision(server.store, 1)
    assert newest.mask == history[2].mask and newest.ignore_mask == history[2].ignore_mask


def test_blind_first_hides_what_machines_say_until_one_has_submitted(server, desk):
    page, frame = desk
    show_layers(frame, SIX_LAYERS)
    frame.select_option("#mode", "blind")
    expect(frame.locator(".pane p", has_text="Hidden until you have submitted")).to_have_count(4)
    expect(frame.locator("#proposal-list li")).to_have_count(0)
    page.keyboard.press("p")
    expect(frame.locator("#notice")).to_contain_text("hidden until you have submitted")
    empty_the_mask(page, frame)
    page.keyboard.press("Enter")
    expect(frame.locator("#state")).to_have_text("submitted")
    expect(frame.locator("#proposal-list li")).to_contain_text("only predicted")
    expect(frame.locator(".pane p", has_text="Hidden until")).to_have_count(0)
    page.keyboard.press("o")
    expect(frame.locator("#state")).to_have_text("in progress")
    page.keyboard.press("Tab")
    page.keyboard.press("v")
    wait_saved(frame, 3)
    assert mask_now(server)[45:55, 55:70].all()
    assert log_of(server, 3)[0]["mode"] == "blind"
    page.keyboard.press("Enter")
    wait_title(frame, "cs1/0001")
    ada = annotator_id(server.store, "Ada")
    assert review_state(server.store, 1, ada) == "submitted"
    expect(frame.locator("#proposal-note")).to_contain_text("Hidden until")


def test_audit_walks_the_regions_in_doubt_across_pairs(server, desk):
    page, frame = desk
    page.keyboard.press("w")
    page.keyboard.press("w")
    expect(frame.locator("#walk")).to_have_text("1 of 2")
    selected = frame.locator('#proposal-list li[aria-selected="true"]')
    expect(selected).to_have_count(1)
    first = frame.locator("#title").inner_text()
    page.keyboard.press("1")
    expect(frame.locator("#walk")).to_have_text("2 of 2")
    expect(frame.locator("#title")).not_to_have_text(first)
    expect(selected).to_have_count(1)
    page.keyboard.press("4")
    expect(frame.locator("#notice")).to_contain_text("last region in doubt")
    rows = server.store.read().execute("SELECT verdict FROM audits ORDER BY id").fetchall()
    assert [row["verdict"] for row in rows] == ["agree", "reject"]


def test_a_verdict_takes_a_reason_and_a_second_opinion_does_not_see_the_first(server, visit):
    page, frame = visit("Ada")
    selected = frame.locator('#proposal-list li[aria-selected="true"]')
    frame.select_option("#mode", "audit")
    frame.select_option("#walkOrder", "loss")
    expect(frame.locator("#walk")).to_contain_text("1 of 2")
    frame.click("#edit-reasons")
    frame.fill("#reasons-text", "glass\nglass")
    frame.click("#save-reasons")
    expect(frame.locator("#reasons-wrong")).to_contain_text("'glass' is there twice")
    frame.fill("#reasons-text", "too dark\nglass")
    frame.click("#save-reasons")
    expect(frame.locator("#reason-list button")).to_have_count(2)
    page.keyboard.press("6")
    expect(frame.locator("#reason-list [aria-pressed=true]")).to_contain_text("glass")
    frame.fill("#comment", "a window")
    page.keyboard.press("Enter")
    page.keyboard.press("4")
    expect(frame.locator("#walk")).to_contain_text("2 of 2")
    expect(frame.locator("#reason-list [aria-pressed=true]")).to_have_count(0)
    row = server.store.read().execute("SELECT * FROM audits").fetchone()
    assert (row["verdict"], row["reason"], row["comment"]) == ("reject", "glass", "a window")
    page, frame = visit("Bob")
    selected = frame.locator('#proposal-list li[aria-selected="true"]')
    frame.select_option("#mode", "audit")
    expect(frame.locator("#walk")).to_contain_text("1 of 1")
    frame.select_option("#walkOpinion", "second")
    expect(frame.locator("#walk")).to_have_text("1 of 1, opposed")
    expect(selected).to_have_count(1)
    assert "glass" not in selected.inner_text() and "✓" not in selected.inner_text()
    assert "after audit" not in frame.locator("#scores").inner_text()
    asked = frame.evaluate("performance.getEntriesByType('resource').map((e) => e.name)")
    assert any("/layers/doi.png" in url and "judged=false" in url for url in asked)
    page.keyboard.press("1")
    expect(frame.locator("#notice")).to_contain_text("last region in doubt")
    said = server.store.read().execute("SELECT annotator, outcome FROM opinions ORDER BY 1")
    assert [row["annotator"] for row in said] == ["Ada", "Bob"]


def test_keys_can_be_changed_but_never_collide(server, desk):
    page, frame = desk
    page.keyboard.press("?")
    frame.click('[data-key="eraser"]')
    page.keyboard.press("b")
    expect(frame.locator("#help-keys [data-taken]")).to_have_attribute("data-taken", "Brush")
    frame.click('[data-key="eraser"]')
    page.keyboard.press("Shift+E")
    expect(frame.locator('[data-key="eraser"]')).to_have_text("Shift+e")
    frame.click("#close-help")
    page.keyboard.press("Shift+E")
    pressed = frame.locator('[data-tool][aria-pressed="true"]')
    expect(pressed).to_have_attribute("data-tool", "eraser")
    page.keyboard.press("b")
    page.keyboard.press("e")
    expect(pressed).to_have_attribute("data-tool", "brush")
    reload(frame)
    wait_title(frame, "cs1/0000")
    page.keyboard.press("Shift+E")
    expect(pressed).to_have_attribute("data-tool", "eraser")
    expect(frame.locator('button[data-tool="eraser"]')).to_have_attribute(
        "title", "Eraser (Shift+e)"
    )
    page.keyboard.press("?")
    frame.click("#reset-keys")
    expect(frame.locator('[data-key="eraser"]')).to_have_text("e")


def test_the_magnetic_lasso_follows_the_edge(server, desk):
    page, frame = desk
    empty_the_mask(page, frame)
    page.keyboard.press("m")
    for corner in ((50, 40), (75, 40), (75, 60), (50, 60)):
        x, y = live_place(frame, corner)
        page.mouse.move(x, y, steps=4)
        page.wait_for_timeout(250)
        page.mouse.click(x, y)
    page.keyboard.press("Enter")
    wait_saved(frame, 3)
    assert intersection_over_union(mask_now(server), square()) > 0.85
    assert log_of(server, 3)[0]["samples"] > 20


def test_the_whole_job_can_be_done_from_the_keyboard(server, desk):
    page, frame = desk
    expect(frame.locator("#proposal-list li")).to_have_count(1)
    page.keyboard.press("Tab")
    page.keyboard.press("v")
    page.keyboard.press("b")
    for _ in range(30):
        page.keyboard.press("Shift+ArrowUp")
    page.keyboard.press("Shift+Enter")
    wait_saved(frame, 3)
    assert [log_of(server, number)[0]["tool"] for number in (2, 3)] == ["add", "brush"]
    page.keyboard.press("F6")
    page.keyboard.press("Tab")
    focused = "document.activeElement.dataset.action"
    assert frame.evaluate(focused) == "previous"
    page.keyboard.press("Escape")
    page.keyboard.press("Enter")
    wait_title(frame, "cs1/0001")


def touch(session, kind, points):
    """Send real touches through the browser."""
    touches = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(points)]
    session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": touches})


def test_two_fingers_zoom_and_draw_nothing(server, desk):
    page, frame = desk
    x, y = live_place(frame, (80, 60))
    where = frame.locator("#where")
    before = int(re.search(r"(\d+) %", where.inner_text())[1])
    session = page.context.new_cdp_session(page)
    touch(session, "touchStart", [(x - 20, y)])
    touch(session, "touchStart", [(x - 20, y), (x + 20, y)])
    for spread in (30, 40, 60, 80):
        touch(session, "touchMove", [(x - spread, y), (x + spread, y)])
    touch(session, "touchEnd", [])
    after = int(re.search(r"(\d+) %", where.inner_text())[1])
    assert after > 2 * before
    drawn_since = mask_now(server)
    page.keyboard.press("f")
    on_live(frame, page, [(20, 90), (60, 90)])
    wait_saved(frame, 2)
    # The stroke is all that was drawn since the fingers left.
    assert [action["tool"] for action in log_of(server, 2)] == ["brush"]
    fresh = mask_now(server) & ~drawn_since
    assert fresh[90, 40] and not fresh[:75].any()


def test_a_finger_draws_until_a_pen_was_seen(server, desk):
    page, frame = desk
    x, y = live_place(frame, (30, 90))
    session = page.context.new_cdp_session(page)
    touch(session, "touchStart", [(x, y)])
    touch(session, "touchMove", [(x + 30, y)])
    touch(session, "touchEnd", [])
    wait_saved(frame, 2)
    for kind, dx in (("mousePressed", 0), ("mouseMoved", 30), ("mouseReleased", 30)):
        event = {"type": kind, "x": x + dx, "y": y - 60, "button": "left", "buttons": 1}
        session.send("Input.dispatchMouseEvent", {**event, "clickCount": 1, "pointerType": "pen"})
    wait_saved(frame, 3)
    x, y = live_place(frame, (30, 110))
    touch(session, "touchStart", [(x, y)])
    touch(session, "touchMove", [(x + 30, y)])
    touch(session, "touchEnd", [])
    on_live(frame, page, [(100, 20), (120, 20)])
    wait_saved(frame, 4)
    # The finger's line would have come before the mouse's, as revision 4 or within it.
    assert len(log_of(server, 4)) == 1 and not mask_now(server)[103:].any()


def test_looking_takes_time_too_and_idling_does_not(server, visit):
    page, frame = visit("Ada", clock=True)
    wait_title(frame, "cs1/0000")
    for _ in range(5):
        page.mouse.move(*live_place(frame, (30, 90)))
        page.wait_for_timeout(150)
        page.mouse.move(*live_place(frame, (90, 30)))
        page.wait_for_timeout(150)
    idle_seconds = 600
    page.clock.fast_forward(1000 * idle_seconds)
    page.keyboard.press("Enter")
    wait_title(frame, "cs1/0001")
    row = server.store.read().execute("SELECT * FROM pair_effort").fetchone()
    assert row["annotator"] == "Ada" and 5 < row["active_seconds"] < 30


def test_patches_flip_back_and_forth(desk):
    _, frame = desk
    assert (
        frame.evaluate(
            """async () => {
            const { History } = await import("/static/js/history.js");
            const { RleCache } = await import("/static/js/rle_cache.js");
            const { encode } = await import("/static/js/rle.js");
            let seed = 7;
            const random = (n) => {
                seed = (seed * 1103515245 + 12345) % 2147483648;
                return seed % n;
            };
            const make = () => ({ width: 37, height: 23, data: new Uint8Array(37 * 23) });
            const masks = { mask: make(), ignore: make() };
            const cache = new RleCache();
            const history = new History();
            const shot = () => [encode(masks.mask), encode(masks.ignore)].join();
            const states = [shot()];
            for (let k = 0; k < 200; k++) {
                const layer = k % 3 ? "mask" : "ignore";
                const before = { ...masks[layer], data: masks[layer].data.slice() };
                const x0 = random(36), y0 = random(22);
                const box = { x0, y0, x1: x0 + 1 + random(37 - x0), y1: y0 + 1 + random(23 - y0) };
                for (let y = box.y0; y < box.y1; y++) {
                    for (let x = box.x0; x < box.x1; x++) masks[layer].data[y * 37 + x] = random(2);
                }
                const action = { tool: "test" };
                if (history.record(layer, before, masks[layer], box, action)) states.push(shot());
                if (layer === "mask") cache.touch(masks.mask, box);
                if (cache.encode(masks.mask) !== encode(masks.mask)) return `run-lengths ${k}`;
            }
            for (let k = states.length - 2; k >= 0; k--) {
                history.undo(masks);
                if (shot() !== states[k]) return `undo ${k}`;
            }
            for (let k = 1; k < states.length; k++) {
                history.redo(masks);
                if (shot() !== states[k]) return `redo ${k}`;
            }
            return "";
        }"""
        )
        == ""
    )
