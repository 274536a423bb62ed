"""A real server in this process, and a real Chromium that visits it."""

import socket
import threading
import time
from dataclasses import dataclass

import pytest
import uvicorn
from find_browser import FLAGS, find_browser
from playwright.sync_api import Frame, Page, sync_playwright
from scenes import write_split
from workbench import workbench_of

from reviewer.app.access import Access
from reviewer.app.desks import Desks
from reviewer.app.gateway import build_gateway
from reviewer.app.shell import Shell
from reviewer.dataset.importer import ImportSettings, import_split
from reviewer.editing.clicks import Clicks
from reviewer.models.click_grabcut import GrabCutClicks
from reviewer.models.embeddings import EmbeddingCache
from reviewer.pipeline.runner import prepare_run, run_pipeline
from reviewer.pipeline.settings import PipelineSettings
from reviewer.store.database import Store
from reviewer.store.pairs import pair_ids

TOKEN = "browser-test-token"


@dataclass
class Running:
    """A server that runs, and what stands behind it."""

    url: str
    store: Store
    shell: Shell
    desks: Desks


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
    listener = socket.socket()
    listener.bind(("127.0.0.1", 0))
    port = listener.getsockname()[1]
    with Store(tmp_path / "reviewer.db", create=True) as store:
        import_split(store, "cs1", folder, ImportSettings(), lambda *_: None)
        run = prepare_run(store, "first", PipelineSettings())
        run_pipeline(store, run, pair_ids(store))
        desks = Desks(store)
        shell = Shell(desks)
        access = Access.create("127.0.0.1", port, TOKEN, [])
        clicks = Clicks(store, EmbeddingCache(GrabCutClicks(), None))
        app = build_gateway(store, access, desks, clicks, shell.port, on_stop=shell.stop)
        config = uvicorn.Config(app, log_level="error", ws="websockets-sansio")
        runner = uvicorn.Server(config)
        thread = threading.Thread(target=runner.run, kwargs={"sockets": [listener]})
        thread.start()
        deadline = time.monotonic() + 20
        while not runner.started and time.monotonic() < deadline:
            time.sleep(0.05)
        yield Running(f"http://127.0.0.1:{port}", store, shell, desks)
        runner.should_exit = True
        thread.join(timeout=20)


@pytest.fixture
def visit(browser, server):
    """Sign a person in, in a browser of their own; return the page and its workbench frame."""
    contexts = []

    def open_for(name: str) -> tuple[Page, Frame]:
        context = browser.new_context(viewport={"width": 1500, "height": 900})
        contexts.append(context)
        page = context.new_page()
        page.goto(f"{server.url}/sign-in#token={TOKEN}")
        page.fill("input[name=name]", name)
        page.click("text=Sign in")
        return page, workbench_of(page)

    yield open_for
    for context in contexts:
        context.close()
