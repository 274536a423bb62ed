"""What the server acknowledged is there after it was killed in the middle of a save."""

import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time

import httpx
import numpy as np
import pytest

from reviewer.masks import encode_rle
from reviewer.store.database import Store
from reviewer.store.revisions import list_revisions

ROUNDS = 30
TOKEN = "a-token-for-crashes"
# Forks a real server for each port it is told, so that the libraries are imported once.
NURSERY = """
import os, sys
from pathlib import Path
from reviewer.app.server import serve_app
print("ready", flush=True)
for line in sys.stdin:
    child = os.fork()
    if not child:
        serve_app(Path(sys.argv[1]), host="127.0.0.1", port=int(line), token=sys.argv[2],
                  allow_hosts=[], click="grabcut")
        os._exit(0)
    print("child", child, flush=True)
    os.waitpid(child, 0)
    print("gone", flush=True)
"""


@pytest.fixture
def nursery(db, tiny_split):
    path = db.path
    db.close()
    command = [sys.executable, "-c", NURSERY, str(path), TOKEN]
    with subprocess.Popen(command, stdin=-1, stdout=-1, text=True) as process:
        assert process.stdout.readline() == "ready\n"
        yield process, path
        process.stdin.close()


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def said(process, word):
    while not (line := process.stdout.readline()).startswith(word):
        assert line, "the nursery ended"
    return line.split()


def save_until_killed(port, seed, acknowledged, saving):
    """Save one mask after another; note each that the server says it has."""
    rng = np.random.default_rng(seed)
    headers = {"Authorization": f"Bearer {TOKEN}", "X-Annotator": "Ada"}
    with httpx.Client(base_url=f"http://127.0.0.1:{port}", headers=headers) as client:
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline:
            try:
                tag = client.get("/api/pairs/1/mask").headers["ETag"]
                break
            except httpx.TransportError:
                time.sleep(0.02)
        while True:
            counts = encode_rle(rng.random((120, 160)) < 0.01).counts
            change = {"mask": {"height": 120, "width": 160, "counts": counts}}
            saving.set()
            try:
                reply = client.put("/api/pairs/1/mask", json=change, headers={"If-Match": tag})
            except httpx.TransportError:
                return
            tag = reply.headers["ETag"]
            acknowledged[reply.json()["revision"]] = counts


def test_nothing_acknowledged_is_lost_when_the_server_is_killed(nursery):
    process, path = nursery
    chance = random.Random(5)
    acknowledged = {}
    for number in range(ROUNDS):
        port, saving = free_port(), threading.Event()
        process.stdin.write(f"{port}\n")
        process.stdin.flush()
        child = int(said(process, "child")[1])
        arguments = (port, number, acknowledged, saving)
        client = threading.Thread(target=save_until_killed, args=arguments)
        client.start()
        assert saving.wait(30)
        time.sleep(chance.uniform(0.0, 0.15))
        os.kill(child, signal.SIGKILL)
        said(process, "gone")
        client.join(30)
        with Store(path) as store:
            stored = {r.number: r.mask.counts for r in list_revisions(store, 1)}
            healthy = store.read().execute("PRAGMA integrity_check").fetchone()[0]
        assert healthy == "ok"
        assert {n: stored.get(n) for n in acknowledged} == acknowledged
        assert sorted(stored) == list(range(1, len(stored) + 1))
    assert len(acknowledged) > ROUNDS
