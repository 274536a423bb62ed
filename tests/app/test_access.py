"""Only signed-in people, only by this server's names, only from its own pages."""

import time

import pytest
from starlette.websockets import WebSocketDisconnect

from reviewer.app.access import Access, is_loopback
from reviewer.errors import InvalidInput

TOKEN = "a-token-for-tests"
HERE = {"Origin": "http://localhost:8000", "Host": "localhost:8000"}


def sign_in(client, name="Ada", token=TOKEN, headers=HERE):
    return client.post("/sign-in", data={"name": name, "token": token}, headers=headers)


def test_a_stranger_is_sent_to_the_sign_in_page(stranger):
    reply = stranger.get("/workbench", headers={"Accept": "text/html"})
    assert (reply.status_code, reply.headers["location"]) == (303, "/sign-in")


@pytest.mark.parametrize(
    "path", ["/api/pairs", "/api/openapi.json", "/static/js/main.js", "/api/me"]
)
def test_a_stranger_gets_no_data(stranger, path):
    reply = stranger.get(path)
    assert reply.status_code == 401
    assert reply.headers["content-type"] == "application/problem+json"
    assert "not signed in" in reply.json()["detail"]


def test_the_token_link_leads_to_a_signed_cookie(stranger):
    page = stranger.get(f"/sign-in?token={TOKEN}")
    assert f'value="{TOKEN}"' in page.text
    reply = sign_in(stranger)
    assert (reply.status_code, reply.headers["location"]) == (303, "/")
    cookie = reply.headers["set-cookie"]
    assert "HttpOnly" in cookie and "SameSite=strict" in cookie
    assert stranger.get("/api/me").json()["annotator"] == "Ada"


def test_names_and_tokens_are_escaped_on_the_page(stranger):
    assert (
        "<script>" not in stranger.get("/sign-in?token=%22%3E%3Cscript%3E&name=%3Cscript%3E").text
    )


def test_a_wrong_token_is_refused(stranger):
    assert sign_in(stranger, token="wrong-token").status_code == 403
    assert sign_in(stranger, token="töken-ü").status_code == 403
    assert stranger.get("/api/me").status_code == 401


def test_a_name_is_needed(stranger):
    reply = sign_in(stranger, name="  ")
    assert reply.status_code == 422 and "1 to 80 characters" in reply.json()["detail"]


@pytest.mark.parametrize("cookie", ["QWRh.0000", "QWRh", "..", "%%%.x", "é.é"])
def test_a_forged_cookie_is_refused(stranger, access, cookie):
    reply = stranger.get("/api/me", headers={"Cookie": f"{access.cookie}={cookie}".encode()})
    assert reply.status_code == 401


def test_a_cookie_of_the_same_token_survives_a_restart(stranger, access):
    again = Access.create("127.0.0.1", 8000, TOKEN, [])
    stranger.cookies.set(access.cookie, again.issue("Bob"))
    assert stranger.get("/api/me").json()["annotator"] == "Bob"


def test_another_host_name_is_refused(stranger):
    reply = stranger.get("/sign-in", headers={"Host": "evil.example"})
    assert reply.status_code == 421 and "evil.example" in reply.json()["detail"]


@pytest.mark.parametrize("host", ["[", "[::1", "a b", ""])
def test_a_malformed_host_is_refused(stranger, host):
    assert stranger.get("/sign-in", headers={"Host": host}).status_code == 421


def test_pages_are_not_static_files(stranger):
    sign_in(stranger)
    assert stranger.get("/static/workbench.html?client=x").status_code == 404
    assert stranger.get("/static/js/main.js").status_code == 200


def test_signing_out_takes_the_cookie_back(stranger):
    sign_in(stranger)
    reply = stranger.post("/sign-out", headers=HERE)
    assert (reply.status_code, reply.headers["location"]) == (303, "/sign-in")
    assert stranger.get("/api/me").status_code == 401


def test_names_of_scripts_may_have_any_letters(stranger):
    headers = {"Authorization": f"Bearer {TOKEN}".encode(), "X-Annotator": "Jürgen".encode()}
    assert stranger.get("/api/me", headers=headers).json()["annotator"] == "Jürgen"


def test_a_body_that_is_too_large_is_refused_before_it_is_read(stranger):
    headers = {**HERE, "Content-Length": "20000"}
    assert stranger.post("/sign-in", content=b"x", headers=headers).status_code == 413


def test_a_body_whose_length_is_not_told_is_refused(client, tiny_split):
    headers = {"If-Match": '"1"', "Content-Type": "image/png"}
    reply = client.put("/api/pairs/1/mask", content=iter([b"x"]), headers=headers)
    assert reply.status_code == 413 and "Content-Length" in reply.json()["detail"]
    reply = client.put("/api/pairs/1/mask", headers=headers)
    assert reply.status_code == 422


def test_a_cookie_ends_after_a_month(stranger, access, monkeypatch):
    stranger.cookies.set(access.cookie, access.issue("Ada"))
    assert stranger.get("/api/me").status_code == 200
    later = time.time() + 31 * 86400
    monkeypatch.setattr("reviewer.app.access.time.time", lambda: later)
    assert stranger.get("/api/me").status_code == 401


@pytest.mark.parametrize("host", ["localhost:9000", "127.0.0.1:8000", "[::1]:8000"])
def test_loopback_names_may_come_by_any_port(stranger, host):
    assert stranger.get("/sign-in", headers={"Host": host}).status_code == 200


@pytest.mark.parametrize("origin", ["http://evil.example", "http://[", "null", None])
def test_a_change_from_another_page_is_refused(stranger, origin):
    sign_in(stranger)
    headers = {"Origin": origin} if origin else {}
    reply = stranger.put("/api/pairs/1/state", json={"state": "todo"}, headers=headers)
    assert reply.status_code == 403


@pytest.mark.parametrize("path", ["/", "/api/desk"])
@pytest.mark.parametrize("origin", [{"Origin": "http://evil.example"}, {}])
def test_a_socket_from_another_page_is_refused(stranger, path, origin):
    sign_in(stranger)
    headers = {"Host": "localhost:8000", **origin}
    with pytest.raises(WebSocketDisconnect), stranger.websocket_connect(path, headers=headers):
        pass


@pytest.mark.parametrize("path", ["/", "/api/desk"])
def test_a_socket_without_a_session_is_refused(stranger, path):
    with pytest.raises(WebSocketDisconnect), stranger.websocket_connect(path, headers=HERE):
        pass


@pytest.mark.parametrize(
    "query", ["websocket=ws://evil.example", "playbackPath=http://evil.example"]
)
def test_viser_cannot_be_pointed_elsewhere(stranger, query):
    sign_in(stranger)
    assert stranger.get(f"/?{query}").status_code == 400


def test_a_host_beyond_this_machine_needs_a_token():
    with pytest.raises(InvalidInput, match="can be reached by others"):
        Access.create("0.0.0.0", 8000, None, [])
    with pytest.raises(InvalidInput, match="at least 8 characters"):
        Access.create("0.0.0.0", 8000, "short", [])
    lab = Access.create("0.0.0.0", 8000, TOKEN, ["lab.example"])
    assert lab.knows_host("lab.example:8000") and not lab.knows_host("0.0.0.0:8000")


@pytest.mark.parametrize(
    ("host", "expected"),
    [("127.0.0.1", True), ("localhost", True), ("::1", True), ("0.0.0.0", False),
     ("192.168.1.5", False), ("localhost.evil.example", False)],
)  # fmt: skip
def test_loopback_is_told_from_the_rest(host, expected):
    assert is_loopback(host) is expected
