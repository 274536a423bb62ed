"""Two people change one pair: each layer is told apart and merged, whatever happens meanwhile."""

import json

import pytest
from playwright.sync_api import expect
from workbench import on_live, reload, wait_saved, wait_title

from reviewer.masks import decode_rle
from reviewer.store.revisions import list_revisions, newest_revision

pytestmark = pytest.mark.browser


@pytest.fixture
def two(server, visit):
    """Ada and Bob, each in a browser of their own, on the same pair, drawing ill-posed pixels."""
    people = [visit("Ada"), visit("Bob")]
    for page, frame in people:
        wait_title(frame, "cs1/0000")
        page.keyboard.press("i")
    return people


def ignored(revision):
    mask = decode_rle(revision.mask)
    return revision.ignore() if revision.ignore_mask else mask & False


def owners(frame):
    frame.wait_for_selector("#conflict[open]")
    return sorted(frame.locator("#conflict-parts button").all_inner_texts())


def on_put(page, handle):
    """Let `handle` answer the page's saves of masks, and the server all else."""
    page.route(
        "**/mask",
        lambda route: handle(route) if route.request.method == "PUT" else route.fallback(),
    )


def problem(status, detail):
    return {
        "status": status,
        "content_type": "application/problem+json",
        "body": json.dumps({"status": status, "detail": detail}),
    }


def test_ill_posed_pixels_of_both_people_survive_a_conflict(server, two):
    (ada_page, ada), (bob_page, bob) = two
    on_live(ada, ada_page, [(20, 90), (60, 90)])
    wait_saved(ada, 2)
    on_live(bob, bob_page, [(20, 20), (60, 20)])
    texts = owners(bob)
    assert [text.rpartition(": ")[2] for text in texts] == ["yours", "Ada"]
    assert all(text.startswith("ill-posed, ") for text in texts)
    bob.click("#conflict-save")
    wait_saved(bob, 4)
    history = list_revisions(server.store, 1)
    layers = [ignored(revision) for revision in history]
    assert [bool(layer[90, 40]) for layer in layers] == [False, True, False, True]
    assert [bool(layer[20, 40]) for layer in layers] == [False, False, True, True]
    assert all(revision.mask == history[0].mask for revision in history)


def test_each_ill_posed_part_can_be_chosen_beside_the_parts_of_the_mask(server, two):
    (ada_page, ada), (bob_page, bob) = two
    on_live(ada, ada_page, [(20, 90), (60, 90)])
    wait_saved(ada, 2)
    ada_page.keyboard.press("i")
    on_live(ada, ada_page, [(100, 90), (140, 90)])
    wait_saved(ada, 3)
    on_live(bob, bob_page, [(20, 20), (60, 20)])
    assert len(owners(bob)) == 3
    bob.click("#all-theirs")
    bob.locator("#conflict-parts button", has_text="at 120, 90").click()
    bob.locator("#conflict-parts button", has_text="at 40, 20").click()
    bob.click("#conflict-save")
    wait_saved(bob, 5)
    newest = newest_revision(server.store, 1)
    assert not decode_rle(newest.mask)[90, 120]
    assert ignored(newest)[90, 40] and ignored(newest)[20, 40]


def test_two_people_who_drew_the_same_are_not_asked(server, two):
    (ada_page, ada), (bob_page, bob) = two
    on_live(ada, ada_page, [(20, 90), (60, 90)])
    wait_saved(ada, 2)
    on_live(bob, bob_page, [(20, 90), (60, 90)])
    wait_saved(bob, 3)
    expect(bob.locator("#conflict")).not_to_be_visible()
    assert ignored(newest_revision(server.store, 1))[90, 40]


def test_parts_of_both_layers_are_compared_and_merged(two):
    (_, ada), _ = two
    found = ada.evaluate(
        """async () => {
            const { compare, merge } = await import("/static/js/merging.js");
            const row = (text) => ({ width: text.length, height: 1,
                data: Uint8Array.from(text, Number) });
            const [base, mine, theirs] = ["00000000", "11000010", "00011010"].map(row);
            const layer = compare("ignore", mine, theirs, base);
            const before = Array.from(merge(layer).data).join("");
            for (const part of layer.parts) part.mine = !part.mine;
            return { parts: layer.parts.map(({ area, box, layer }) => [layer, area, box]), before,
                after: Array.from(merge(layer).data).join(""),
                alone: compare("mask", mine, theirs, null).parts.map(({ mine }) => mine) };
        }"""
    )
    assert found == {
        "parts": [["ignore", 2, [0, 0, 2, 1]], ["ignore", 2, [3, 0, 5, 1]]],
        "before": "11011010",
        "after": "00000010",
        "alone": [True, True],
    }


def test_two_conflicts_at_once_are_asked_about_one_after_the_other(server, two):
    (ada_page, ada), (bob_page, bob) = two
    on_put(bob_page, lambda route: route.abort())
    for frame, page, y in ((bob, bob_page, 20), (ada, ada_page, 90)):
        on_live(frame, page, [(20, y), (60, y)])
        if frame is ada:
            wait_saved(ada, 2)
        page.keyboard.press("ArrowRight")
        wait_title(frame, "cs1/0001")
        on_live(frame, page, [(20, y), (60, y)])
    wait_saved(ada, 2)
    bob_page.unroute("**/mask")
    bob.evaluate("window.dispatchEvent(new Event('online'))")
    bob.wait_for_selector("#conflict[open]")
    bob_page.wait_for_timeout(1000)
    expect(bob.locator("#conflict-text")).to_contain_text("cs1/0000")
    bob.click("#conflict-save")
    expect(bob.locator("#conflict-text")).to_contain_text("cs1/0001")
    expect(bob.locator("#save")).to_have_attribute("data-status", "conflict")
    bob.click("#conflict-save")
    wait_saved(bob, 4)
    for pair in (1, 2):
        newest = newest_revision(server.store, pair)
        assert newest.number == 4 and ignored(newest)[90, 40] and ignored(newest)[20, 40]


def test_what_is_saved_while_a_conflict_is_asked_about_is_compared_too(server, two):
    (ada_page, ada), (bob_page, bob) = two
    on_live(ada, ada_page, [(20, 90), (60, 90)])
    wait_saved(ada, 2)
    on_live(bob, bob_page, [(20, 20), (60, 20)])
    bob.wait_for_selector("#conflict[open]")
    on_live(ada, ada_page, [(100, 90), (140, 90)])
    wait_saved(ada, 3)
    bob.click("#conflict-save")
    expect(bob.locator("#conflict-text")).to_contain_text("Ada has saved revision 3")
    assert len(owners(bob)) == 3
    bob.click("#conflict-save")
    wait_saved(bob, 5)
    layer = ignored(newest_revision(server.store, 1))
    assert layer[90, 40] and layer[90, 120] and layer[20, 40]


@pytest.mark.parametrize("which", [1, 2])
def test_a_conflict_whose_save_fails_is_asked_about_again(server, two, which):
    (ada_page, ada), (bob_page, bob) = two
    on_live(ada, ada_page, [(20, 90), (60, 90)])
    wait_saved(ada, 2)
    on_live(bob, bob_page, [(20, 20), (60, 20)])
    bob.wait_for_selector("#conflict[open]")
    saves = []

    def fail_once(route):
        saves.append(route)
        if len(saves) == which:
            route.fulfill(**problem(507, "the disk is full; make room"))
        else:
            route.fallback()

    on_put(bob_page, fail_once)
    bob.click("#conflict-save")
    expect(bob.locator("#conflict-text")).to_contain_text("the disk is full; make room")
    expect(bob.locator("#conflict")).to_be_visible()
    bob.click("#conflict-save")
    wait_saved(bob, 4)
    expect(bob.locator("#conflict")).to_be_hidden()
    layer = ignored(newest_revision(server.store, 1))
    assert layer[90, 40] and layer[20, 40]


def test_reopening_a_pair_does_not_answer_its_conflict(server, two):
    (ada_page, ada), (bob_page, bob) = two
    on_live(ada, ada_page, [(20, 90), (60, 90)])
    wait_saved(ada, 2)
    bob_page.route(
        "**/mask",
        lambda route: route.abort() if route.request.method == "GET" else route.fallback(),
    )
    on_live(bob, bob_page, [(20, 20), (60, 20)])
    expect(bob.locator("#save")).to_have_attribute("data-status", "conflict")
    expect(bob.locator("#notice")).to_contain_text("cannot be reached")
    bob_page.unroute("**/mask")
    with bob_page.expect_response("**/state"):
        bob_page.keyboard.press("o")
    bob_page.wait_for_timeout(1000)
    assert newest_revision(server.store, 1).annotator == "Ada"
    reload(bob)
    assert len(owners(bob)) == 2


def test_the_status_line_names_the_pair_that_waits_for_a_decision(two):
    _, (page, frame) = two
    on_put(page, lambda route: route.fulfill(**problem(422, "the mask is too small")))
    on_live(frame, page, [(20, 20), (60, 20)])
    expect(frame.locator("#save")).to_have_attribute("data-status", "refused")
    page.unroute("**/mask")
    page.keyboard.press("ArrowRight")
    wait_title(frame, "cs1/0001")
    on_live(frame, page, [(20, 20), (60, 20)])
    expect(frame.locator("#facts")).to_contain_text("revision 2")
    expect(frame.locator("#save")).to_have_attribute("data-status", "refused")
    expect(frame.locator("#save")).to_contain_text("cs1/0000")
