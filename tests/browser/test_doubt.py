"""A pair that cannot be compared says so in the panes, and one key skips it."""

import pytest
from playwright.sync_api import expect
from workbench import choose, on_live, wait_saved, wait_title

from reviewer.store.regions import load_prediction, load_regions
from reviewer.store.skips import skip_of_pair

pytestmark = pytest.mark.browser

DOUBT = "forward-backward error 337.0 px"
REASONS = f"{DOUBT}, and 1 more reason"


@pytest.fixture
def desk(server, visit):
    """Ada at a workbench whose first pair is in doubt."""
    server.store.write(
        lambda c: c.execute(
            "UPDATE alignments SET doubt = ? WHERE pair_id = 1",
            [f"{DOUBT}; reaches 9% of the view"],
        )
    )
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")
    frame.locator(".pane canvas").first.hover()
    return page, frame


def notes(frame):
    return frame.locator(".pane p")


def asked_for(frame):
    return frame.evaluate("performance.getEntriesByType('resource').map((e) => e.name)")


def test_the_panes_show_the_raw_reference_and_say_why(server, desk):
    page, frame = desk
    choose(frame, "#pane-count", "6")
    frame.locator(".pane select").nth(5).select_option("prediction")
    picker = frame.locator(".pane select").first
    expect(notes(frame).nth(0)).to_have_text(
        f"Reference as taken: the warp is in doubt ({REASONS})"
    )
    expect(notes(frame).nth(5)).to_have_text(f"In doubt: {REASONS}")
    expect(notes(frame).nth(1)).to_have_text("")
    expect(picker).to_have_value("reference")
    assert not any("/pairs/1/layers/warped.png" in url for url in asked_for(frame))
    frame.locator(".pane select").nth(2).select_option("difference")
    expect(notes(frame).nth(2)).to_have_text(f"In doubt: {REASONS}")
    expect(frame.locator("#facts")).to_contain_text(f"in doubt: {DOUBT}; reaches 9% of the view")
    # Who wants to see the warp all the same sees it, and the next pair has its own.
    with page.expect_request("**/pairs/1/layers/warped.png*"):
        picker.select_option("warped")
    expect(notes(frame).nth(0)).to_have_text(f"In doubt: {REASONS}")
    picker.select_option("reference")
    page.keyboard.press("ArrowRight")
    wait_title(frame, "cs1/0001")
    expect(picker).to_have_value("warped")
    expect(notes(frame).nth(0)).to_have_text("")


def test_one_key_skips_the_pair_and_the_button_takes_it_up_again(server, desk):
    page, frame = desk
    page.keyboard.press("Shift+B")
    wait_title(frame, "cs1/0001")
    notice = frame.locator("#notice")
    expect(notice).to_contain_text("cs1/0000 is skipped as badly aligned: 1 region rejected.")
    assert skip_of_pair(server.store, 1).annotator == "Ada"
    assert [r.verdict for r in load_regions(server.store, 1, 1)] == ["reject"]
    page.keyboard.press("ArrowLeft")
    wait_title(frame, "cs1/0000")
    expect(frame.locator("#state")).to_have_text("skipped")
    on_live(frame, page, [(20, 90), (60, 90)])
    expect(notice).to_contain_text("This pair is skipped. Press O to reopen it.")
    page.keyboard.press("o")
    expect(frame.locator("#state")).to_have_text("to do")
    assert skip_of_pair(server.store, 1) is None
    assert load_prediction(server.store, 1, 1, "audited") is None
    on_live(frame, page, [(20, 90), (60, 90)])
    wait_saved(frame, 2)
    page.keyboard.press("Shift+B")
    wait_title(frame, "cs1/0001")
    notice.get_by_role("button", name="Undo").click()
    wait_title(frame, "cs1/0000")
    expect(frame.locator("#state")).to_have_text("in progress")
    assert skip_of_pair(server.store, 1) is None


def test_the_queue_shows_skipped_pairs_and_filters_them(server, desk):
    page, frame = desk
    page.keyboard.press("Shift+B")
    wait_title(frame, "cs1/0001")
    expect(page.get_by_text("⊘ cs1/0000")).to_be_visible()


def test_a_walk_leaves_out_the_other_regions_of_a_pair_that_is_skipped(desk):
    _, frame = desk
    assert frame.evaluate(
        """async () => {
            const { AuditWalk } = await import("/static/js/audit_walk.js");
            const walk = new AuditWalk();
            const stops = [[1, 7], [2, 8], [3, 7], [4, 7], [5, 9]];
            walk.stops = stops.map(([region, pair]) => ({ region, pair }));
            walk.place = 2;
            walk.leave(7);
            return [walk.progress, walk.step(1).region, walk.step(-1).region, walk.stops.length];
        }"""
    ) == ["1 of 2", 5, 2, 2]
