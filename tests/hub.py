"""A hub that serves a folder as the public one serves a model: metadata, hashes, ranges."""

import hashlib
import json
import re
import socket
import threading
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

COMMIT = "c" * 40


@contextmanager
def serve_hub(folder, *, cut_after=None, gated=False, lie=False):
    """Yield (address, requests so far).

    Args:
        cut_after: break the first transfer of a file after so many bytes.
        lie: state a wrong hash for the weights.
    """
    asked = []
    cut = {"left": cut_after is not None}

    class Hub(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def log_message(self, *_):
            pass

        def do_HEAD(self):
            self.answer(body=False)

        def do_GET(self):
            self.answer(body=True)

        def answer(self, *, body):
            asked.append((self.command, self.path, self.headers.get("Range")))
            if self.path.startswith("/api/models/lab/tiny"):
                return self.reply(200, json.dumps(metadata(folder, lie)).encode())
            found = re.fullmatch(r"/(?:lab/tiny/resolve/main|files)/([\w.]+)", self.path)
            if not found or not (folder / found[1]).is_file():
                return self.reply(404, b"", {"X-Error-Code": "RepoNotFound"})
            if gated:
                return self.reply(403, b"", {"X-Error-Code": "GatedRepo"})
            return self.send_file((folder / found[1]).read_bytes(), found[1], body=body)

        def send_file(self, content, name, *, body):
            etag = hashes(content, name)[0]
            start = int((self.headers.get("Range") or "bytes=0-")[6:].split("-")[0])
            part = content[start:]
            self.send_response(206 if start else 200)
            self.send_header("ETag", f'"{etag}"')
            self.send_header("X-Repo-Commit", COMMIT)
            self.send_header("Content-Length", str(len(part)))
            self.send_header("Content-Type", "application/octet-stream")
            if start:
                whole = len(content)
                self.send_header("Content-Range", f"bytes {start}-{whole - 1}/{whole}")
            self.end_headers()
            if not body:
                return
            if cut["left"] and name.endswith((".safetensors", ".pth")):
                cut["left"] = False
                self.wfile.write(part[:cut_after])
                self.wfile.flush()
                self.connection.shutdown(socket.SHUT_RDWR)
                return
            self.wfile.write(part)

        def reply(self, status, content, headers=None):
            self.send_response(status)
            for key, value in (headers or {}).items():
                self.send_header(key, value)
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            if self.command == "GET":
                self.wfile.write(content)

    server = ThreadingHTTPServer(("127.0.0.1", 0), Hub)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}", asked
    finally:
        server.shutdown()
        server.server_close()


def hashes(content, name):
    """The hash by which the hub knows a file, and whether it is stored as a large file."""
    if name.endswith(".safetensors"):
        return hashlib.sha256(content).hexdigest(), True
    return hashlib.sha1(f"blob {len(content)}\0".encode() + content).hexdigest(), False


def metadata(folder, lie):
    siblings = []
    for path in sorted(folder.iterdir()):
        content = path.read_bytes()
        digest, large = hashes(content, path.name)
        entry = {"rfilename": path.name, "size": len(content), "blobId": digest}
        if large:
            stated = "0" * 64 if lie else digest
            entry["lfs"] = {"sha256": stated, "size": len(content), "pointerSize": 130}
        siblings.append(entry)
    return {
        "id": "lab/tiny",
        "sha": COMMIT,
        "siblings": siblings,
        "tags": ["license:mit"],
        "private": False,
    }
