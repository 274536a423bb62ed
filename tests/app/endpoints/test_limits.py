"""What is too large for its pair is refused before it costs memory."""

import json
import struct
import zlib

import cv2
import numpy as np
import pytest

from reviewer.masks import decode_rle, empty_rle, encode_rle

REVISION = {"If-Match": '"1"'}


def png_of(height, width):
    """A PNG that says in its header how large it is, and holds nothing."""
    header = struct.pack(">IIBBBBB", width, height, 1, 0, 0, 0, 0)
    data = b"\x89PNG\r\n\x1a\n"
    for kind, body in ((b"IHDR", header), (b"IDAT", zlib.compress(b"")), (b"IEND", b"")):
        data += struct.pack(">I", len(body)) + kind + body
        data += struct.pack(">I", zlib.crc32(kind + body))
    return data


def put_mask(client, mask, **change):
    rle = {"height": mask.height, "width": mask.width, "counts": mask.counts}
    return client.put("/api/pairs/1/mask", json={"mask": rle, **change}, headers=REVISION)


@pytest.fixture
def mask(tiny_split):
    return empty_rle(120, 160)


def test_a_picture_of_another_size_is_refused_by_its_header(client, tiny_split, monkeypatch):
    def decode(*_):
        raise AssertionError("a picture of another size was decoded")

    monkeypatch.setattr(cv2, "imdecode", decode)
    headers = {**REVISION, "Content-Type": "image/png"}
    for data in (png_of(30000, 30000), png_of(160, 120)):
        reply = client.put("/api/pairs/1/mask", content=data, headers=headers)
        assert reply.status_code == 422, reply.text
        assert "160x120" in reply.json()["detail"] and "cs1/" in reply.json()["detail"]


def test_other_kinds_of_pictures_are_no_mask(client, mask):
    headers = {**REVISION, "Content-Type": "image/png"}
    data = cv2.imencode(".bmp", decode_rle(mask).astype(np.uint8))[1].tobytes()
    reply = client.put("/api/pairs/1/mask", content=data, headers=headers)
    assert reply.status_code == 422 and "PNG" in reply.json()["detail"]


def test_run_lengths_of_another_size_are_refused_before_they_are_read(client, mask, monkeypatch):
    def read(*_):
        raise AssertionError("run-lengths of another size were read")

    monkeypatch.setattr("reviewer.masks._runs", read)
    large = {"height": 20000, "width": 20000, "counts": "0" * 1000}
    reply = client.put("/api/pairs/1/mask", json={"mask": large}, headers=REVISION)
    assert reply.status_code == 422
    assert "20000x20000" in reply.json()["detail"] and "160x120" in reply.json()["detail"]


@pytest.mark.parametrize("layer", ["mask", "ignore"])
def test_run_lengths_longer_than_any_of_that_size_are_not_read(client, mask, monkeypatch, layer):
    seen = []
    monkeypatch.setattr("reviewer.masks._runs", lambda counts: seen.append(len(counts)) or [19200])
    endless = "0" * (3 * 120 * 160)
    if layer == "mask":
        long = {"height": 120, "width": 160, "counts": endless}
        reply = client.put("/api/pairs/1/mask", json={"mask": long}, headers=REVISION)
    else:
        reply = put_mask(client, mask, ignore=endless)
    assert reply.status_code == 422 and "run-lengths" in reply.json()["detail"]
    assert len(endless) not in seen


def test_a_click_corrects_a_candidate_of_the_pairs_size_only(client, run, monkeypatch):
    monkeypatch.setattr("reviewer.masks._runs", lambda counts: pytest.fail("they were read"))
    previous = {"counts": "0" * 100_000, "score": 0.5}
    click = {"client": "w", "clicks": [{"x": 1, "y": 1}], "previous": previous}
    reply = client.post("/api/pairs/1/click", json=click)
    assert reply.status_code == 422 and "run-lengths" in reply.json()["detail"]


def test_a_body_larger_than_any_mask_of_the_pair_is_not_parsed(client, mask, monkeypatch):
    monkeypatch.setattr(
        "reviewer.app.endpoints.messages.MaskChange.model_validate_json",
        lambda *_: pytest.fail("it was parsed"),
    )
    reply = put_mask(client, mask, tool_log=[{"tool": "x" * 2_000_000}])
    assert reply.status_code == 413 and "cs1/" in reply.json()["detail"]


def deep(levels):
    value = 1
    for _ in range(levels):
        value = [value]
    return value


@pytest.mark.parametrize(
    ("log", "rule"),
    [([{"tool": "x" * 300_000}], "256 KiB"),
     ([{"a": 1}] * 2001, "2000"),
     ([{"tool": deep(20)}], "deep"),
     ([{"x": float("nan")}], "number"),
     ([{"x": [float("-inf")]}], "number"),
     ([{"tool": "brush\x00"}], "U+0000"),
     ([{"tool": [{"of": "a\x1b[2J"}]}], "U+001B"),
      ([{"too\x07l": 1}], "U+0007")],
)  # fmt: skip
def test_a_tool_log_is_bounded(client, mask, log, rule):
    body = {"mask": {"height": 120, "width": 160, "counts": mask.counts}, "tool_log": log}
    headers = {**REVISION, "Content-Type": "application/json"}
    reply = client.put("/api/pairs/1/mask", content=json.dumps(body), headers=headers)
    assert reply.status_code == 422, reply.text
    told = reply.json()["detail"].replace("_", " ")
    assert "tool log" in told and rule in told
    assert len(client.get("/api/pairs/1/revisions").json()) == 1


def test_the_finest_mask_and_a_long_log_fit(client, tiny_split):
    checked = np.indices((120, 160)).sum(axis=0) % 2 == 0
    log = [{"tool": "lasso", "points": [[k, k] for k in range(9000)]}]
    reply = put_mask(client, encode_rle(checked), ignore=encode_rle(~checked).counts, tool_log=log)
    assert reply.status_code == 200, reply.text


def test_other_endpoints_take_no_large_bodies(client, tiny_split):
    reasons = {"reasons": ["x" * 1_100_000]}
    assert client.put("/api/reasons", json=reasons).status_code == 413
    click = {"client": "x" * 4_200_000}
    assert client.post("/api/pairs/1/click", json=click).status_code == 413
