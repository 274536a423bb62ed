"""Stories of people at the review desk, in a real Chromium."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import expect
from viser import transforms
from workbench import (
    on_live,
    press_in_menu,
    wait_proposals,
    wait_saved,
    wait_title,
    workbench_of,
)

from reviewer.export.png import export_png
from reviewer.export.selection import Selection, select_labelled
from reviewer.masks import decode_png, decode_rle
from reviewer.store.layers import load_objects
from reviewer.store.regions import load_prediction
from reviewer.store.reviews import annotator_id, review_state
from reviewer.store.revisions import list_revisions, newest_revision

pytestmark = pytest.mark.browser


def mask_of(server, pair_id):
    return decode_rle(newest_revision(server.store, pair_id).mask)


def test_paint_erase_undo_reload(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    before = mask_of(server, 1)
    page.keyboard.press("b")
    on_live(frame, page, [(20, 90), (60, 90)])
    wait_saved(frame, 2)
    painted = mask_of(server, 1)
    assert painted[90, 20:60].all() and painted[40:60, 50:75].all()
    page.keyboard.press("e")
    on_live(frame, page, [(40, 80), (40, 100)])
    wait_saved(frame, 3)
    assert not mask_of(server, 1)[85:95, 40].any()
    page.keyboard.press("Control+z")
    wait_saved(frame, 4)
    assert (mask_of(server, 1) == painted).all()
    page.keyboard.press("Control+z")
    wait_saved(frame, 5)
    assert (mask_of(server, 1) == before).all()
    page.keyboard.press("Control+Shift+z")
    wait_saved(frame, 6)
    page.reload()
    frame = workbench_of(page)
    wait_title(frame, "cs1/0000")
    assert frame.locator("#facts").inner_text().find(f"mask {painted.sum()} px") > 0
    assert frame.locator("#state").inner_text() == "in progress"
    history = list_revisions(server.store, 1)
    assert [r.number for r in history] == [1, 2, 3, 4, 5, 6]
    assert history[1].annotator == "Ada" and history[1].active_seconds > 0


def test_a_pair_is_opened_from_the_map(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    (client,) = server.shell._server.get_clients().values()
    page.locator(".mantine-Notification-closeButton").first.click(timeout=3000)
    press_in_menu(frame, "map")
    page.wait_for_timeout(1500)  # the camera settles after the map has grown
    target = np.array([2.03 + 0.2, 0.0, 0.45])
    local = transforms.SO3(client.camera.wxyz).as_matrix().T @ (target - client.camera.position)
    focal = 0.5 / np.tan(client.camera.fov / 2)
    across = 0.5 + focal * local[0] / local[2] / client.camera.aspect
    down = 0.5 + focal * local[1] / local[2]
    box = page.locator("canvas").first.bounding_box()
    page.mouse.move(box["x"] + across * box["width"], box["y"] + down * box["height"])
    page.wait_for_timeout(300)
    page.mouse.down()
    page.wait_for_timeout(60)
    page.mouse.up()
    wait_title(frame, "cs1/0002")


def test_a_flipped_decision_moves_the_prediction(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    frame.locator(".pane canvas").first.hover()
    wait_proposals(frame)
    page.keyboard.press("Tab")
    frame.wait_for_selector('.region[aria-selected="true"]')
    assert frame.locator(".region .choice").inner_text() == "adopt"
    page.keyboard.press("4")
    frame.wait_for_selector('.region .choice[data-choice="reject"]')
    assert load_prediction(server.store, 1, 1, "audited").area == 0
    frame.wait_for_selector('#scores tr[data-method="audited"]')
    page.keyboard.press("2")
    frame.wait_for_selector('.region .choice[data-choice="adopt"]')
    assert load_prediction(server.store, 1, 1, "audited") == load_prediction(
        server.store, 1, 1, "doi"
    )


def test_the_key_for_the_first_proposal_waits_for_a_list_that_is_on_its_way(visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    page.route("**/proposals*", lambda route: (page.wait_for_timeout(700), route.continue_()))
    page.keyboard.press("ArrowRight")
    wait_title(frame, "cs1/0001")
    page.keyboard.press("Tab")
    frame.wait_for_selector('#proposal-list li[aria-selected="true"]')


def test_a_region_is_put_into_the_mask_with_one_key(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    on_live(frame, page, [(20, 90), (60, 90)])
    wait_saved(frame, 2)
    wait_proposals(frame)
    page.keyboard.press("Tab")
    page.keyboard.press("d")
    wait_saved(frame, 3)
    assert not mask_of(server, 1)[45:55, 55:70].any() and mask_of(server, 1)[90, 40]
    page.keyboard.press("v")
    wait_saved(frame, 4)
    (thing,) = [o for o in load_objects(server.store, 1, 1) if o.side == "live"]
    added = decode_rle(thing.mask)
    assert (mask_of(server, 1)[30:70] == added[30:70]).all()
    page.keyboard.press("f")
    on_live(frame, page, [(62, 50), (100, 50)])
    wait_saved(frame, 5)
    assert mask_of(server, 1)[50, 95]
    page.keyboard.press("r")
    wait_saved(frame, 6)
    assert (mask_of(server, 1)[30:70] == added[30:70]).all() and mask_of(server, 1)[90, 40]
    log = server.store.read().execute(
        "SELECT tool_log FROM mask_revisions WHERE pair_id = 1 AND number = 4"
    )
    assert json.loads(log.fetchone()[0]) == [{"tool": "add", "proposal": "1/region/0"}]


def test_submit_export_and_compare(server, visit, tmp_path):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    on_live(frame, page, [(20, 90), (50, 100)])
    wait_saved(frame, 2)
    page.keyboard.press("Enter")
    wait_title(frame, "cs1/0001")
    ada = annotator_id(server.store, "Ada")
    assert review_state(server.store, 1, ada) == "submitted"
    page.keyboard.press("0")
    wait_title(frame, "cs1/0002")
    assert review_state(server.store, 2, ada) == "confirmed_empty"
    everything = Selection()
    export_png(select_labelled(server.store, everything)[0], tmp_path / "out", everything)
    for pair, name in ((1, "0000"), (2, "0001"), (3, "0002")):
        exported = decode_png((tmp_path / "out" / "cs1" / f"{name}.png").read_bytes())
        assert (exported == mask_of(server, pair)).all()
    assert not mask_of(server, 2).any() and mask_of(server, 1)[95, 35]


def test_a_finished_pair_is_locked_until_it_is_reopened(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    press_in_menu(frame, "approve")
    wait_title(frame, "cs1/0001")
    page.keyboard.press("ArrowLeft")
    wait_title(frame, "cs1/0000")
    frame.wait_for_selector('#state[data-state="approved"]')
    on_live(frame, page, [(20, 90), (60, 90)])
    assert "Press O to reopen" in frame.locator("#notice").inner_text()
    page.keyboard.press("o")
    frame.wait_for_selector('#state[data-state="in_progress"]')
    on_live(frame, page, [(20, 90), (60, 90)])
    wait_saved(frame, 2)


def test_two_people_work_at_once_and_a_conflict_loses_neither(server, visit):
    ada_page, ada = visit("Ada")
    bob_page, bob = visit("Bob")
    for frame in (ada, bob):
        wait_title(frame, "cs1/0000")
    on_live(ada, ada_page, [(20, 90), (60, 90)])
    wait_saved(ada, 2)
    on_live(bob, bob_page, [(20, 20), (60, 20)])
    bob.wait_for_selector("#conflict[open]")
    assert "Ada has saved revision 2" in bob.locator("#conflict-text").inner_text()
    # What only one of the two has touched is theirs without asking.
    owners = bob.locator("#conflict-parts button").all_inner_texts()
    assert sorted(owner.rpartition(": ")[2] for owner in owners) == ["Ada", "yours"]
    bob.click("#conflict-save")
    wait_saved(bob, 4)
    history = list_revisions(server.store, 1)
    people = [(1, None), (2, "Ada"), (3, "Bob"), (4, "Bob")]
    assert [(r.number, r.annotator) for r in history] == people
    masks = [decode_rle(revision.mask) for revision in history]
    assert [bool(mask[90, 40]) for mask in masks] == [False, True, False, True]
    assert [bool(mask[20, 40]) for mask in masks] == [False, False, True, True]


def test_in_a_conflict_each_part_can_be_chosen(server, visit):
    (ada_page, ada), (bob_page, bob) = visit("Ada"), visit("Bob")
    for frame in (ada, bob):
        wait_title(frame, "cs1/0000")
    on_live(ada, ada_page, [(20, 90), (60, 90)])
    wait_saved(ada, 2)
    on_live(bob, bob_page, [(20, 20), (60, 20)])
    bob.wait_for_selector("#conflict[open]")
    bob_page.keyboard.press("Escape")
    bob.wait_for_selector("#conflict[open]")
    for button in bob.locator("#conflict-parts button").all():
        button.click()
    bob.click("#conflict-save")
    wait_saved(bob, 4)
    merged = mask_of(server, 1)
    assert not merged[90, 40] and not merged[20, 40] and merged[50, 60]


def test_work_done_offline_is_sent_when_the_server_is_back(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    page.context.set_offline(True)
    on_live(frame, page, [(20, 90), (60, 90)])
    frame.wait_for_selector('#save[data-status="offline"]')
    on_live(frame, page, [(20, 100), (60, 100)])
    assert newest_revision(server.store, 1).number == 1
    page.context.set_offline(False)
    frame.wait_for_selector('#save[data-status="saved"]', timeout=15_000)
    masks = [decode_rle(revision.mask) for revision in list_revisions(server.store, 1)]
    assert [bool(mask[90, 40]) for mask in masks] == [False, True, True]
    assert [bool(mask[100, 40]) for mask in masks] == [False, False, True]


def test_a_pair_that_the_server_fails_at_waits_and_others_are_saved(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    detail = json.dumps({"status": 507, "detail": "database x: the disk is full; make room"})
    tried = []

    def fail(route):
        if route.request.method != "PUT":
            return route.continue_()
        tried.append(route.request.post_data)
        return route.fulfill(status=507, content_type="application/problem+json", body=detail)

    page.context.route("**/api/pairs/1/mask", fail)
    on_live(frame, page, [(20, 90), (60, 90)])
    frame.wait_for_selector('#save[data-status="not saved"]')
    assert "the disk is full; make room" in frame.locator("#save").inner_text()
    page.keyboard.press("ArrowRight")
    wait_title(frame, "cs1/0001")
    on_live(frame, page, [(20, 90), (60, 90)])
    expect(frame.locator("#facts")).to_contain_text("revision 2")
    assert mask_of(server, 2)[90, 40] and not mask_of(server, 1)[90, 40]
    frame.wait_for_selector('#save[data-status="not saved"]')
    assert tried
    page.context.unroute("**/api/pairs/1/mask")
    frame.wait_for_selector('#save[data-status="saved"]', timeout=20_000)
    assert mask_of(server, 1)[90, 40]


def test_a_stranger_at_visers_port_sees_nothing(server, visit, browser):
    _, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    context = browser.new_context()
    page = context.new_page()
    page.goto(f"http://127.0.0.1:{server.shell.port}")
    page.wait_for_selector(".workbench-place", state="attached", timeout=30_000)
    page.wait_for_timeout(1000)
    text = page.locator("body").inner_text()
    assert "cs1" not in text and "Queue" not in text and "Ada" not in text
    context.close()


def test_no_link_unlocks_a_strangers_client(server, visit, browser):
    ada, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    context = browser.new_context()
    page = context.new_page()
    page.goto(f"http://127.0.0.1:{server.shell.port}")
    place = page.wait_for_selector(".workbench-place", state="attached", timeout=30_000)
    nonce = place.get_attribute("data-client")
    assert server.desks.find(nonce).annotator is None
    for path in ("/workbench", "/"):
        ada.goto(f"{server.url}{path}?client={nonce}")
        ada.wait_for_timeout(2500)
        assert server.desks.find(nonce).annotator is None
    context.close()


def test_run_lengths_in_the_browser_agree_with_python(server, visit):
    _, frame = visit("Ada")
    vectors = json.loads((Path(__file__).parent.parent / "static" / "rle_vectors.json").read_text())
    results = frame.evaluate(
        """async (vectors) => {
            const { encode, decode } = await import("/static/js/rle.js");
            return vectors.map(({ rows, counts }) => {
                const [height, width] = [rows.length, rows[0].length];
                const data = Uint8Array.from(rows.flat());
                const back = decode(counts, width, height);
                return [encode({ width, height, data }), back.data.every((v, i) => v === data[i])];
            });
        }""",
        vectors,
    )
    assert results == [[v["counts"], True] for v in vectors]
    damaged = frame.evaluate(
        """async () => {
            const { decode } = await import("/static/js/rle.js");
            return ["~", "o", "1"].map((text) => {
                try { decode(text, 4, 4); return "read"; } catch (error) { return error.message; }
            });
        }"""
    )
    assert all(re.search("run-lengths", message) for message in damaged)


def test_no_two_actions_share_a_key(server, visit):
    _, frame = visit("Ada")
    keys = frame.evaluate("async () => (await import('/static/js/keys.js')).KEYS")
    assert len({entry["key"] for entry in keys}) == len(keys)
    buttons = frame.evaluate(
        "[...document.querySelectorAll('button[data-action]')].map((b) => b.dataset.action)"
    )
    assert set(buttons) <= {entry["action"] for entry in keys}
