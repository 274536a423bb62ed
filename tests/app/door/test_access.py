"""Only signed-in people, only by this server's names, only from its own pages."""

from datetime import UTC, datetime, timedelta

import pytest
from people import heard
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from reviewer.app.door.access import Access, is_loopback
from reviewer.app.door.gateway import HEADERS, build_gateway
from reviewer.errors import InvalidInput
from reviewer.store.database import stamp

TOKEN = "a-token-for-tests"
BASE = "http://localhost:8000"
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


def test_a_wrong_token_of_a_script_is_logged_and_keeps_nobody_out(stranger, caplog):
    for _ in range(5):
        assert stranger.get("/api/me", headers={"Authorization": "Bearer no"}).status_code == 401
    assert sum("wrong token" in record.message for record in caplog.records) == 5
    assert stranger.get("/api/me", headers={"Authorization": f"Bearer {TOKEN}"}).status_code == 200
    assert sign_in(stranger).status_code == 303


def test_the_token_leads_to_a_session(stranger):
    reply = sign_in(stranger)
    assert (reply.status_code, reply.headers["location"]) == (303, "/")
    cookie = reply.headers["set-cookie"]
    assert "HttpOnly" in cookie and "SameSite=strict" in cookie and "Secure" not in cookie
    assert stranger.get("/api/me").json()["annotator"] == "Ada"


def test_a_token_in_the_query_moves_into_the_fragment(stranger):
    reply = stranger.get("/sign-in?token=a%2Bb%26c&name=%3CAda%3E")
    assert reply.status_code == 303
    assert reply.headers["location"] == "/sign-in?name=%3CAda%3E#token=a%2Bb%26c"
    assert 'src="/static/sign-in.js"' in stranger.get("/sign-in").text
    assert stranger.get("/static/sign-in.js").status_code == 200


def test_names_are_escaped_on_the_page(stranger):
    given = "%22%3E%3Cscript%3Ex%3C/script%3E"
    assert "<script>x" not in stranger.get(f"/sign-in?name={given}").text
    assert "<script>x" not in sign_in(stranger, '"><script>x</script>', "wrong-token").text


def test_a_wrong_token_shows_the_form_again_with_the_name(stranger):
    for token in ("wrong-token", "töken-ü"):
        reply = sign_in(stranger, token=token)
        assert reply.status_code == 403 and "text/html" in reply.headers["content-type"]
        assert "not this server" in reply.text and 'value="Ada"' in reply.text
        assert token not in reply.text
    assert stranger.get("/api/me").status_code == 401


def test_wrong_tokens_make_an_address_wait_and_nobody_else(app, caplog):
    there, here = (
        TestClient(app, base_url=BASE, follow_redirects=False, client=(address, 1))
        for address in ("192.0.2.1", "192.0.2.2")
    )
    for _ in range(3):
        assert sign_in(there, token="wrong-token").status_code == 403
    reply = sign_in(there)
    assert reply.status_code == 429 and reply.headers["retry-after"] == "1"
    assert "Wait 1 seconds" in reply.text and 'value="Ada"' in reply.text
    assert sign_in(here).status_code == 303
    assert "sign-in from 192.0.2.1: wrong token, 3 in a row" in caplog.text
    assert "wrong-token" not in caplog.text


def test_a_name_is_needed(stranger):
    reply = sign_in(stranger, name="  ")
    assert reply.status_code == 422 and "1 to 80 characters" in reply.text
    assert "<form" in reply.text


@pytest.mark.parametrize("cookie", ["QWRh.0000", "QWRh", "..", "%%%.x", "é.é"])
def test_a_forged_cookie_is_refused(stranger, access, cookie):
    reply = stranger.get("/api/me", headers={"Cookie": f"{access.cookie}={cookie}".encode()})
    assert reply.status_code == 401


def test_a_server_started_again_with_the_same_token_knows_its_people(stranger, db, desks, clicks):
    sign_in(stranger, "Bob")
    for token, status in ((TOKEN, 200), ("another-token-for-tests", 401)):
        access = Access.create("127.0.0.1", 8000, token, [])
        app = build_gateway(db, access, desks, clicks, viser_port=9)
        again = TestClient(app, base_url=BASE, cookies=dict(stranger.cookies))
        assert again.get("/api/me").status_code == status


def test_the_database_signs_nobody_in(stranger, access, db):
    sign_in(stranger)
    (row,) = db.read().execute("SELECT * FROM sessions").fetchall()
    cookie = stranger.cookies[access.cookie]
    assert cookie not in tuple(row) and len(cookie) > 40
    stranger.cookies.clear()
    forged = {"Cookie": f"{access.cookie}={row['key']}"}
    assert stranger.get("/api/me", headers=forged).status_code == 401


def test_a_cookie_behind_tls_is_secure(app):
    client = TestClient(app, base_url="https://localhost:8000", follow_redirects=False)
    origin = {"Origin": "https://localhost:8000", "Host": "localhost:8000"}
    assert "Secure" in sign_in(client, headers=origin).headers["set-cookie"]


def test_what_is_ours_is_read_by_our_pages_only(client):
    for path in ("/api/me", "/static/js/main.js", "/sign-in"):
        assert client.get(path).headers["cross-origin-resource-policy"] == "same-origin"


def test_answers_of_the_guard_are_as_strict_as_all_others(stranger):
    replies = {
        401: stranger.get("/api/me"),
        403: stranger.post("/sign-in", headers={"Origin": "http://evil.example"}),
        421: stranger.get("/sign-in", headers={"Host": "evil.example"}),
        303: stranger.get("/workbench", headers={"Accept": "text/html"}),
    }
    assert {status: reply.status_code for status, reply in replies.items()} == {
        status: status for status in replies
    }
    for reply in replies.values():
        assert reply.headers.items() >= {(name.lower(), text) for name, text in HEADERS.items()}


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


def test_signing_out_ends_the_session_of_a_copied_cookie(stranger, access, app):
    sign_in(stranger)
    copied = TestClient(app, base_url=BASE, cookies=dict(stranger.cookies))
    assert copied.get("/api/me").status_code == 200
    reply = stranger.post("/sign-out", headers=HERE)
    assert (reply.status_code, reply.headers["location"]) == (303, "/sign-in")
    assert stranger.get("/api/me").status_code == 401
    assert copied.get("/api/me").status_code == 401


def test_signing_out_ends_windows_that_are_open(stranger, app, run):
    sign_in(stranger)
    cookie = {"Cookie": "; ".join("=".join(pair) for pair in stranger.cookies.items())}
    with stranger.websocket_connect("/api/desk", headers={**HERE, **cookie}) as socket:
        assert heard(socket)["type"] == "ready"
        TestClient(app, base_url=BASE, cookies=dict(stranger.cookies)).post(
            "/sign-out", headers=HERE
        )
        socket.send_json({"type": "showing", "pair": 1})
        with pytest.raises(WebSocketDisconnect):
            heard(socket)


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


def test_a_session_ends_after_a_month(stranger, db):
    sign_in(stranger)
    for days, status in ((29, 200), (31, 401)):
        begun = stamp(datetime.now(UTC) - timedelta(days=days))
        db.write(lambda c, begun=begun: c.execute("UPDATE sessions SET created_at = ?", [begun]))
        assert stranger.get("/api/me").status_code == status
    sign_in(stranger, "Bob")
    assert db.read().execute("SELECT count(*) FROM sessions").fetchone()[0] == 1


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
    for host, names in (("0.0.0.0", []), ("127.0.0.1", ["lab.example"])):
        with pytest.raises(InvalidInput, match=r"at least 16 characters where others .*, not 15"):
            Access.create(host, 8000, "x" * 15, names)
    with pytest.raises(InvalidInput, match="at least 8 characters, not 5"):
        Access.create("127.0.0.1", 8000, "short", [])
    lab = Access.create("0.0.0.0", 8000, TOKEN, ["lab.example"])
    assert lab.knows_host("lab.example:8000") and not lab.knows_host("0.0.0.0:8000")


@pytest.mark.parametrize(
    ("host", "expected"),
    [("127.0.0.1", True), ("localhost", True), ("::1", True), ("0.0.0.0", False),
     ("192.168.1.5", False), ("localhost.evil.example", False)],
)  # fmt: skip
def test_loopback_is_told_from_the_rest(host, expected):
    assert is_loopback(host) is expected
