"""A real server in this process, and a real Chromium that visits it."""

import socket
import threading
import time

import pytest
import uvicorn
from find_browser import FLAGS, find_browser
from playwright.sync_api import Frame, Page, sync_playwright
from scenes import write_split
from workbench import workbench_of

from reviewer.app.desks import Desks
from reviewer.app.door.access import Access
from reviewer.app.door.gateway import build_gateway
from reviewer.app.shell import Shell
from reviewer.dataset.importer import ImportSettings, import_split
from reviewer.editing.clicks import Clicks
from reviewer.models.clicks.embeddings import EmbeddingCache
from reviewer.models.clicks.grabcut import GrabCutClicks
from reviewer.pipeline.runner import prepare_run, run_pipeline
from reviewer.pipeline.settings import PipelineSettings
from reviewer.store.database import Store
from reviewer.store.pairs import pair_ids

TOKEN = "browser-test-token"


class Running:
    """A server over a store, on a port it keeps, and what stands behind it."""

    def __init__(self, store: Store) -> None:
        self.store = store
        self.port = 0
        self.start()
        self.url = f"http://127.0.0.1:{self.port}"

    def start(self) -> None:
        """Serve: the first time on a free port, later on the same one."""
        listener = socket.socket()
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(("127.0.0.1", self.port))
        self.port = listener.getsockname()[1]
        self.desks = Desks(self.store)
        self.shell = Shell(self.desks)
        access = Access.create("127.0.0.1", self.port, TOKEN, [])
        clicks = Clicks(self.store, EmbeddingCache(GrabCutClicks(), None))
        app = build_gateway(
            self.store, access, self.desks, clicks, self.shell.port, on_stop=self.shell.stop
        )
        config = uvicorn.Config(
            app, log_level="error", ws="websockets-sansio", timeout_graceful_shutdown=2
        )
        self._runner = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._runner.run, kwargs={"sockets": [listener]})
        self._thread.start()
        deadline = time.monotonic() + 20
        while not self._runner.started and time.monotonic() < deadline:
            time.sleep(0.05)
        assert self._runner.started

    def stop(self) -> None:
        """Go away, as a server does that is stopped; the store stays."""
        self._runner.should_exit = True
        self._thread.join(timeout=20)
        assert not self._thread.is_alive()


@pytest.fixture(scope="session")
def browser():
    """One Chromium for all stories."""
    path = find_browser()
    assert path, "no browser: run `python tests/find_browser.py`"
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield chromium
        chromium.close()


@pytest.fixture
def server(tmp_path):
    """A gateway on a free port, over a split of three pairs and a finished run."""
    folder = write_split(tmp_path / "cs1")
    with Store(tmp_path / "reviewer.db", create=True) as store:
        import_split(store, "cs1", folder, ImportSettings(), lambda *_: None)
        run = prepare_run(
            store, "first", PipelineSettings(segmenter="oversegment", detector="difference")
        )
        run_pipeline(store, run, pair_ids(store))
        running = Running(store)
        yield running
        running.stop()


@pytest.fixture
def visit(browser, server):
    """Sign a person in, in a browser of their own; return the page and its workbench frame.

    With `clock`, the test may let the browser's time jump.
    """
    contexts = []

    def open_for(name: str, clock: bool = False) -> tuple[Page, Frame]:
        context = browser.new_context(viewport={"width": 1500, "height": 900})
        contexts.append(context)
        page = context.new_page()
        if clock:
            context.clock.install()
        page.goto(f"{server.url}/sign-in#token={TOKEN}")
        page.fill("input[name=name]", name)
        page.click("text=Sign in")
        frame = workbench_of(page)
        frame.click("#tour-skip")
        return page, frame

    yield open_for
    for context in contexts:
        context.close()
