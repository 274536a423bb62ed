"""Two people change one pair: what they drew as ill-posed is told apart and merged too."""

import pytest
from playwright.sync_api import expect
from workbench import on_live, wait_saved, wait_title

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
    return revision.ignore() if revision.ignore_rle else mask & False


def owners(frame):
    frame.wait_for_selector("#conflict[open]")
    return sorted(frame.locator("#conflict-parts button").all_inner_texts())


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
