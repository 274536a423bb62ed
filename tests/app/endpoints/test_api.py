"""The API that scripts rely on."""

import re
import time

import cv2
import numpy as np
import pytest
from fastapi.routing import APIRoute
from people import heard

from reviewer.evaluation.counting import refresh_counts
from reviewer.masks import decode_png, decode_rle, empty_rle, encode_png, encode_rle
from reviewer.store.layers import load_objects
from reviewer.store.regions import load_prediction

JSON = {"Accept": "application/json"}
HERE = {"Origin": "http://localhost:8000", "Host": "localhost:8000"}


def picture(client, path):
    reply = client.get(path)
    assert reply.status_code == 200, reply.text
    return cv2.imdecode(np.frombuffer(reply.content, np.uint8), cv2.IMREAD_UNCHANGED)


def some_mask(value=True):
    mask = np.zeros((120, 160), bool)
    mask[5:9, 7:20] = value
    return mask


def put_png(client, pair, revision, data=None, headers=None):
    own = {"If-Match": f'"{revision}"', "Content-Type": "image/png", **(headers or {})}
    content = encode_png(some_mask()) if data is None else data
    return client.put(f"/api/pairs/{pair}/mask", content=content, headers=own)


def put_json(client, pair, revision, **change):
    rle = encode_rle(some_mask())
    body = {"mask": {"height": rle.height, "width": rle.width, "counts": rle.counts}, **change}
    return client.put(f"/api/pairs/{pair}/mask", json=body, headers={"If-Match": f'"{revision}"'})


def test_the_queue_is_paged_and_filtered(client, run):
    page = client.get("/api/pairs", params={"limit": 2, "order": "size"}).json()
    assert page["total"] == 3 and len(page["pairs"]) == 2
    assert page["pairs"][0]["change_px"] >= page["pairs"][1]["change_px"] > 0
    assert (
        client.get("/api/pairs", params={"split": "cs1", "state": "submitted"}).json()["total"] == 0
    )


@pytest.mark.parametrize("params", [{"limit": 0}, {"order": "colour"}, {"state": "x"}, {"limt": 3}])
def test_a_bad_query_is_told(client, params):
    reply = client.get("/api/pairs", params=params)
    assert reply.status_code == 422
    assert next(iter(params)) in reply.json()["detail"]


def test_a_pair_tells_its_layers_regions_and_scores(client, run, tiny_split):
    detail = client.get(f"/api/pairs/{tiny_split[0].id}").json()
    assert set(detail["layers"]) >= {"reference", "live", "warped", "doi", "prediction"}
    (region,) = detail["regions"]
    assert region["f_b"] == 1 and 0 < region["doi"] < 0.9 and region["choice"] == "adopt"
    assert (detail["revision"], detail["state"], detail["run"]) == (1, "todo", run.name)


def test_a_pair_without_a_run_has_its_images(client, tiny_split):
    detail = client.get(f"/api/pairs/{tiny_split[0].id}").json()
    assert detail["layers"] == ["reference", "live", "ground_truth"] and detail["run"] is None


def layer(client, name):
    return picture(client, f"/api/pairs/1/layers/{name}.png")


@pytest.mark.parametrize("side", ["reference", "live"])
def test_the_image_layers_are_the_files_pixels(client, run, tiny_split, side):
    path = str(getattr(tiny_split[0], side).path)
    assert (layer(client, side) == cv2.imread(path)).all()


def test_the_warped_layer_shows_the_reference_where_the_live_image_sees_it(client, run):
    warped, live = (layer(client, name).astype(int) for name in ("warped", "live"))
    off = np.abs(warped - live).max(axis=2)
    # The textures agree everywhere but at the square, which is only in the live image.
    assert np.median(off[44:56, 54:71]) > 60 and np.median(off[70:110]) < 12
    assert warped.shape == live.shape == (120, 160, 3)


def test_the_difference_layer_is_bright_where_something_changed_and_dark_elsewhere(client, run):
    heat = layer(client, "difference").sum(axis=2)
    assert heat.shape == (120, 160)
    assert heat[44:56, 54:71].min() > 3 * np.median(heat[70:110])


@pytest.mark.parametrize("name", ["detector", "objects_live", "doi", "prediction"])
def test_a_result_layer_covers_the_square_and_leaves_the_rest_clear(client, run, name):
    alpha = layer(client, name)[..., 3]
    assert alpha.shape == (120, 160)
    assert (alpha[42:58, 52:73] > 0).mean() > 0.9
    # A probability under one half is a tint under half the strongest, 200.
    assert max(alpha[75:].max(), alpha[:25].max()) < 100


def test_the_objects_layers_show_the_stored_objects_of_their_side(client, run, db):
    for side in ("live", "reference"):
        union = np.zeros((120, 160), bool)
        for thing in load_objects(db, run.id, 1):
            if thing.side == side:
                union |= decode_rle(thing.mask)
        assert ((layer(client, f"objects_{side}")[..., 3] > 0) == union).all()


def test_the_prediction_layer_is_the_predicted_mask(client, run, db):
    alpha = layer(client, "prediction")[..., 3] > 0
    assert (alpha == decode_rle(load_prediction(db, run.id, 1, "doi"))).all()
    assert alpha[42:58, 52:73].all() and alpha.sum() < 800


def test_the_ground_truth_layer_is_the_newest_mask(client, run):
    assert ((layer(client, "ground_truth")[..., 3] > 0).nonzero()[0].size) == 20 * 25
    put_png(client, 1, 1)
    assert ((layer(client, "ground_truth")[..., 3] > 0) == some_mask()).all()


def test_a_layer_that_is_not_there_is_told(client, tiny_split):
    reply = client.get("/api/pairs/1/layers/doi.png")
    assert reply.status_code == 404 and "needs a run" in reply.json()["detail"]
    assert client.get("/api/pairs/1/layers/colour.png").status_code == 422
    assert client.get("/api/pairs/99/layers/live.png").status_code == 404


@pytest.mark.parametrize("layer", ["live", "difference"])
def test_a_replaced_image_is_told_in_its_place(client, run, tiny_split, layer):
    path = f"/api/pairs/1/layers/{layer}.png"
    assert client.get(path).status_code == 200
    tiny_split[0].live.path.write_bytes(tiny_split[1].live.path.read_bytes())
    reply = client.get(path)
    assert reply.status_code == 422
    assert "0000.png: is not the image that was imported" in reply.json()["detail"]
    click = {"client": "w", "clicks": [{"x": 9, "y": 9}]}
    reply = client.post("/api/pairs/1/click", json=click)
    assert reply.status_code == 422 and "0000.png" in reply.json()["detail"]


def test_a_layer_is_kept_by_the_browser_only_under_its_version(client, run):
    version = client.get("/api/pairs/1").json()["version"]
    kept = client.get("/api/pairs/1/layers/doi.png", params={"v": version})
    assert "max-age" in kept.headers["cache-control"]
    assert client.get("/api/pairs/1/layers/doi.png").headers["cache-control"] == "no-store"


def test_the_mask_comes_as_png_or_run_lengths_with_its_revision(client, tiny_split):
    png = client.get("/api/pairs/1/mask")
    assert (png.headers["etag"], png.headers["content-type"]) == ('"1"', "image/png")
    body = client.get("/api/pairs/1/mask", headers=JSON).json()
    assert body["mask"]["counts"] == encode_rle(decode_png(png.content)).counts
    assert body["revision"] == 1


@pytest.mark.parametrize("put", [put_png, put_json])
def test_a_mask_is_committed_on_its_revision(client, tiny_split, put):
    reply = put(client, 1, 1)
    assert (reply.status_code, reply.json(), reply.headers["etag"]) == (200, {"revision": 2}, '"2"')
    assert (decode_png(client.get("/api/pairs/1/mask").content) == some_mask()).all()
    assert client.get("/api/pairs/1").json()["state"] == "in_progress"
    history = client.get("/api/pairs/1/revisions").json()
    assert [(r["number"], r["annotator"]) for r in history] == [(1, None), (2, "Ada")]


@pytest.mark.parametrize("put", [put_png, put_json])
def test_a_stale_revision_is_409_and_changes_nothing(client, tiny_split, put):
    put_png(client, 1, 1, encode_png(~some_mask()))
    reply = put(client, 1, 1)
    assert reply.status_code == 409 and "the newest is 2" in reply.json()["detail"]
    assert len(client.get("/api/pairs/1/revisions").json()) == 2


GREY = np.arange(120 * 160).astype(np.uint8).reshape(120, 160)


@pytest.mark.parametrize("put", [put_png, put_json])
def test_saying_the_same_again_is_one_revision(client, tiny_split, put):
    assert put(client, 1, 1).json() == put(client, 1, 1).json() == {"revision": 2}
    assert len(client.get("/api/pairs/1/revisions").json()) == 2


def test_ill_posed_pixels_stay_ignored_until_they_are_cleared(client, tiny_split):
    ignore = encode_rle(some_mask()).counts
    put_json(client, 1, 1, ignore=ignore)
    put_png(client, 1, 2, encode_png(~some_mask()))
    assert client.get("/api/pairs/1/mask", headers=JSON).json()["ignore"] == ignore
    client.put("/api/pairs/1/state", json={"state": "confirmed_empty"})
    assert client.get("/api/pairs/1/mask", headers=JSON).json()["ignore"] == ignore
    client.put("/api/pairs/1/state", json={"state": "in_progress"})
    put_json(client, 1, 4, ignore=encode_rle(some_mask(False)).counts)
    assert client.get("/api/pairs/1/mask", headers=JSON).json()["ignore"] is None


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"no png",
        encode_png(np.zeros((4, 4), bool)),
        cv2.imencode(".png", GREY)[1].tobytes(),
    ],
)
def test_a_malformed_png_is_422(client, tiny_split, data):
    assert put_png(client, 1, 1, data).status_code == 422
    assert client.get("/api/pairs/1/mask").headers["etag"] == '"1"'


@pytest.mark.parametrize(
    "change",
    [{"mask": {"height": 120, "width": 160, "counts": "~~"}},
     {"mask": {"height": 120, "width": 160, "counts": "1"}},
     {"mask": {"height": -1, "width": 160, "counts": "1"}},
     {"active_seconds": -1}, {"active_seconds": 1e9}, {"tool_log": [3]}, {"colour": 1},
     {"ignore": "~"}, {"tool_log": [{}] * 2001}],
)  # fmt: skip
def test_a_malformed_change_is_422(client, tiny_split, change):
    reply = put_json(client, 1, 1, **change)
    assert reply.status_code == 422, reply.text
    assert reply.headers["content-type"] == "application/problem+json"


def test_json_that_is_none_and_other_types_are_422(client, tiny_split):
    for kind in ("application/json", "text/plain"):
        headers = {"If-Match": '"1"', "Content-Type": kind}
        assert client.put("/api/pairs/1/mask", content=b"{", headers=headers).status_code == 422


@pytest.mark.parametrize("match", [None, "x", '"-1"', "*"])
def test_a_commit_needs_its_revision(client, tiny_split, match):
    headers = {"Content-Type": "image/png", **({"If-Match": match} if match else {})}
    reply = client.put("/api/pairs/1/mask", content=encode_png(some_mask()), headers=headers)
    assert reply.status_code == 422 and "If-Match" in reply.json()["detail"]


def test_states_are_set_and_lock(client, tiny_split):
    reply = client.put("/api/pairs/1/state", json={"state": "confirmed_empty"})
    truth = {"revision": 2, "standing": "confirmed_empty", "said_by": ["Ada"], "changed_by": []}
    assert reply.json() == {"state": "confirmed_empty", "revision": 2, "truth": truth}
    assert put_png(client, 1, 2).status_code == 423
    client.put("/api/pairs/1/state", json={"state": "in_progress"})
    assert put_png(client, 1, 2).status_code == 200
    assert client.put("/api/pairs/1/state", json={"state": "done"}).status_code == 422
    assert client.put("/api/pairs/99/state", json={"state": "approved"}).status_code == 404


def test_a_pair_tells_which_revision_was_approved_and_who_changed_it_since(client, tiny_split):
    imported = {"revision": 1, "standing": "imported", "said_by": [], "changed_by": []}
    assert client.get("/api/pairs/1").json()["truth"] == imported
    client.put("/api/pairs/1/state", json={"state": "approved"})
    put_png(client, 1, 1, headers={"X-Annotator": "Bob"})
    found = client.get("/api/pairs/1").json()
    assert found["revision"] == 2
    assert found["truth"] == {
        "revision": 1, "standing": "approved", "said_by": ["Ada"], "changed_by": ["Bob"]
    }  # fmt: skip
    (row,) = client.get("/api/pairs", params={"team": "changed"}).json()["pairs"]
    assert (row["id"], row["state"], row["team"]) == (1, "approved", "changed")


def test_a_state_is_not_set_on_a_revision_that_was_not_seen(client, tiny_split):
    put_png(client, 1, 1)
    stale = {"If-Match": '"1"'}
    reply = client.put("/api/pairs/1/state", json={"state": "approved"}, headers=stale)
    assert reply.status_code == 409 and "the newest is 2" in reply.json()["detail"]


def test_confirming_empty_keeps_the_scores(client, run):
    client.put("/api/pairs/1/state", json={"state": "confirmed_empty"})
    assert client.get("/api/pairs/1").json()["scores"]["doi"]["tp"] == 0


@pytest.mark.parametrize(
    ("path", "status"),
    [("/api/pairs/99999999999999999999", 422), ("/api/pairs/0", 422), ("/api/nothing", 404)],
)
def test_every_error_is_problem_json(client, tiny_split, path, status):
    reply = client.get(path)
    assert reply.status_code == status
    assert reply.headers["content-type"] == "application/problem+json"


def test_a_verdict_moves_the_prediction(client, run):
    before = client.get("/api/pairs/1").json()
    region = before["regions"][0]["id"]
    after = client.post(f"/api/regions/{region}/audit", json={"verdict": "reject"}).json()
    assert after["regions"][0]["verdict"] == "reject"
    assert after["regions"][0]["audited_by"] == "Ada"
    assert after["version"] != before["version"]
    assert after["scores"]["audited"]["tp"] == 0
    assert not picture(client, "/api/pairs/1/layers/prediction.png")[..., 3].any()


def test_bad_verdicts_are_refused(client, run):
    assert client.post("/api/regions/99/audit", json={"verdict": "keep"}).status_code == 404
    assert client.post("/api/regions/1/audit", json={"verdict": "perhaps"}).status_code == 422


def endpoints(router):
    """Every HTTP endpoint, those of included routers too."""
    for route in router.routes:
        if isinstance(route, APIRoute):
            yield route
        elif hasattr(route, "original_router"):
            yield from endpoints(route.original_router)


def test_the_interface_is_described_whole(client):
    paths = client.get("/api/openapi.json").json()["paths"]
    operations = {
        (m.upper(), p): about for p, methods in paths.items() for m, about in methods.items()
    }
    pages = {"/", "/workbench", "/favicon.ico", "/sign-in", "/sign-out", "/api/docs"}
    served = [
        (method, "/api" + route.path.removeprefix("/api"))
        for route in endpoints(client.app)
        if route.path not in pages
        for method in route.methods
    ]
    assert sorted(served) == sorted(operations)
    for (method, path), about in operations.items():
        assert about.get("description"), f"{method} {path} does not say what it does"
        named = {p["name"] for p in about.get("parameters", []) if p["in"] == "path"}
        assert named == set(re.findall(r"{(\w+)}", path)), f"{method} {path}"
        assert about["responses"], f"{method} {path}"


def test_a_change_of_a_mask_is_described_with_both_of_its_bodies(client):
    paths = client.get("/api/openapi.json").json()["paths"]
    put = paths["/api/pairs/{pair_id}/mask"]["put"]
    assert set(put["requestBody"]["content"]) == {"image/png", "application/json"}
    assert {
        "/api/pairs",
        "/api/pairs/{pair_id}/layers/{layer}.png",
        "/api/regions/{region_id}/audit",
    } <= set(paths)


def test_a_desk_follows_its_person(client, run):
    with client.websocket_connect("/api/desk", headers=HERE) as socket:
        ready = heard(socket)
        assert (ready["annotator"], ready["run"], ready["pair"]) == ("Ada", run.name, 1)
        assert ready["fresh"]
        socket.send_json({"type": "showing", "pair": 1})
        assert heard(socket) == {"type": "ahead", "pairs": [2, 3]}
        socket.send_json({"type": "step", "by": 1})
        assert heard(socket)["pair"] == 2
        socket.send_json({"type": "showing", "pair": 3})
        heard(socket)
        socket.send_json({"type": "step", "by": 1})
        assert heard(socket) == {"type": "end", "by": 1}


def test_a_desk_that_gets_nonsense_says_so_and_goes_on(client, run):
    with client.websocket_connect("/api/desk", headers=HERE) as socket:
        heard(socket)
        for nonsense in ({"type": "showing", "pair": "x"}, {"type": "fly"}, [1], {"type": "step"}):
            socket.send_json(nonsense)
            assert heard(socket)["type"] == "error"
        socket.send_json({"type": "showing", "pair": 1})
        assert heard(socket)["type"] == "ahead"


def test_a_frame_unlocks_the_desk_of_its_client(client, run, desks):
    nonce, desk = desks.create()
    drawn = []
    desk.redraw = drawn.append
    assert desk.annotator is None
    with client.websocket_connect(f"/api/desk?client={nonce}", headers=HERE) as socket:
        heard(socket)
        # The frame is told first, the Viser side is drawn next.
        deadline = time.monotonic() + 5
        while not drawn and time.monotonic() < deadline:
            time.sleep(0.01)
        assert (desk.annotator, drawn) == ("Ada", ["unlock"])
        desk.open_pair(3)
        assert heard(socket) == {"type": "open", "pair": 3, "run": run.name}
    with client.websocket_connect(f"/api/desk?client={nonce}", headers=HERE) as socket:
        assert heard(socket)["pair"] == 3


def test_a_desk_follows_who_is_signed_in_now(client, run, desks):
    nonce, desk = desks.create()
    desk.annotator = "Bob"
    with client.websocket_connect(f"/api/desk?client={nonce}", headers=HERE) as socket:
        heard(socket)
        assert desk.annotator == "Ada"


def test_f_of_the_pair_by_outcome_is_what_a_verdict_then_gives(client, db, run):
    refresh_counts(db)
    region = client.get("/api/pairs/1").json()["regions"][0]
    assert set(region["f_if"]) == {"adopt", "keep", "reject"}
    scores = client.get("/api/pairs/1").json()["scores"]
    assert region["f_if"][region["choice"]] == pytest.approx(scores["doi"]["f_score"])
    for verdict in ("keep", "reject", "adopt"):
        audit = client.post(f"/api/regions/{region['id']}/audit", json={"verdict": verdict})
        found = audit.json()["scores"]["audited"]["f_score"]
        assert found == pytest.approx(region["f_if"][verdict])
        again = client.get("/api/pairs/1").json()["regions"][0]["f_if"]
        assert again == pytest.approx(region["f_if"])


def test_what_would_leave_a_pair_rightly_empty_has_no_f(client, db, run):
    empty = {"height": 120, "width": 160, "counts": empty_rle(120, 160).counts}
    client.put("/api/pairs/1/mask", json={"mask": empty}, headers={"If-Match": '"1"'})
    client.put("/api/pairs/1/state", json={"state": "submitted"})
    (region,) = client.get("/api/pairs/1").json()["regions"]
    assert region["f_if"] == {"adopt": 0.0, "keep": 0.0, "reject": None}


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [("PUT", "/api/pairs/99/state", {"state": "in_progress"}),
     ("PUT", "/api/pairs/99/skip", {}),
     ("PUT", "/api/pairs/1/skip", {"run": "none"}),
     ("POST", "/api/regions/99/audit", {"verdict": "agree"}),
     ("PUT", "/api/audits/99", {"stands": False})],
)  # fmt: skip
def test_a_change_of_what_does_not_exist_makes_nobody(client, db, run, method, path, body):
    people = "SELECT name FROM annotators ORDER BY id"
    before = [row["name"] for row in db.read().execute(people)]
    reply = client.request(method, path, json=body, headers={"X-Annotator": "Nobody"})
    assert reply.status_code == 404
    assert [row["name"] for row in db.read().execute(people)] == before
