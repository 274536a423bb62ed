"""A gateway in the process, with a run to look at."""

import pytest
from starlette.testclient import TestClient

from reviewer.app.desks import Desks
from reviewer.app.door.access import Access
from reviewer.app.door.gateway import build_gateway

TOKEN = "a-token-for-tests"
BASE = "http://localhost:8000"


@pytest.fixture
def access():
    return Access.create("127.0.0.1", 8000, TOKEN, [])


@pytest.fixture
def desks(db):
    return Desks(db)


@pytest.fixture
def app(db, access, desks, clicks):
    return build_gateway(db, access, desks, clicks, viser_port=9)


@pytest.fixture
def stranger(app):
    """A client that is not signed in."""
    return TestClient(app, base_url=BASE, follow_redirects=False)


@pytest.fixture
def client(app):
    """A script's client."""
    headers = {"Authorization": f"Bearer {TOKEN}", "X-Annotator": "Ada"}
    return TestClient(app, base_url=BASE, headers=headers)
