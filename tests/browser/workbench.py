"""What several stories do with the workbench frame."""

from playwright.sync_api import Frame, Page, expect


def workbench_of(page: Page) -> Frame:
    """Wait for the workbench inside Viser to show a pair."""
    element = page.wait_for_selector("iframe.workbench-frame", timeout=30_000)
    frame = element.content_frame()
    expect(frame.locator("#title")).not_to_have_text("…", timeout=30_000)
    frame.wait_for_selector(".pane canvas")
    return frame
