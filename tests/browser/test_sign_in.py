"""Signing in and out, in a real Chromium."""

import pytest
from playwright.sync_api import expect
from workbench import wait_title, workbench_of

TOKEN = "browser-test-token"

pytestmark = pytest.mark.browser


@pytest.mark.parametrize("way", ["#token=", "?token="])
def test_the_token_leaves_the_address_and_a_wrong_one_shows_the_form(server, browser, way):
    context = browser.new_context()
    page = context.new_page()
    page.goto(f"{server.url}/sign-in{way}wrong-token")
    expect(page.locator("input[name=token]")).to_have_value("wrong-token")
    assert page.url == f"{server.url}/sign-in"
    page.fill("input[name=name]", "Ada")
    page.click("text=Sign in")
    expect(page.locator("[role=alert]")).to_contain_text("not this server's")
    expect(page.locator("input[name=name]")).to_have_value("Ada")
    page.fill("input[name=token]", TOKEN)
    page.click("button")
    wait_title(workbench_of(page), "cs1/0000")
    assert "token" not in page.evaluate("location.href")
    context.close()
