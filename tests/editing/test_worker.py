"""One worker a device: clicks first, stale requests dropped."""

from concurrent.futures import CancelledError
from threading import Event

import pytest

from reviewer.editing.worker import Urgency, Worker


@pytest.fixture
def worker():
    worker = Worker("test")
    yield worker
    worker.stop()


@pytest.fixture
def busy(worker):
    """Keep the worker busy until the event is set."""
    go_on, begun = Event(), Event()
    worker.submit("blocker", Urgency.CLICK, lambda: (begun.set(), go_on.wait(10)))
    begun.wait(10)
    yield go_on
    go_on.set()


def test_clicks_come_before_previews_before_work_ahead(worker, busy):
    done = []
    for number, urgency in enumerate((Urgency.AHEAD, Urgency.PREVIEW, Urgency.CLICK)):
        last = worker.submit(number, urgency, lambda u=urgency: done.append(u))
    others = [worker.submit(9, Urgency.AHEAD, lambda: done.append("last"))]
    busy.set()
    last.result(5)
    others[0].result(5)
    assert done == [Urgency.CLICK, Urgency.PREVIEW, Urgency.AHEAD, "last"]


def test_a_newer_request_of_a_client_drops_the_one_that_waits(worker, busy):
    stale = worker.submit("Ada", Urgency.PREVIEW, lambda: "stale")
    other = worker.submit("Ben", Urgency.CLICK, lambda: "other")
    newer = worker.submit("Ada", Urgency.CLICK, lambda: "newer")
    busy.set()
    assert newer.result(5) == "newer" and other.result(5) == "other"
    with pytest.raises(CancelledError):
        stale.result(0)


def test_work_ahead_does_not_drop_a_click_nor_the_other_way_round(worker, busy):
    click = worker.submit("Ada", Urgency.CLICK, lambda: "click")
    ahead = worker.submit("Ada", Urgency.AHEAD, lambda: "ahead")
    busy.set()
    assert click.result(5) == "click" and ahead.result(5) == "ahead"


def test_an_error_reaches_who_waits_and_the_worker_goes_on(worker):
    broken = worker.submit("Ada", Urgency.CLICK, lambda: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        broken.result(5)
    assert worker.submit("Ada", Urgency.CLICK, lambda: 7).result(5) == 7


def test_stopping_drops_what_waits(worker, busy):
    waiting = worker.submit("Ada", Urgency.CLICK, lambda: 1)
    busy.set()
    worker.stop()
    assert waiting.cancelled() or waiting.result(0) == 1
    with pytest.raises(RuntimeError, match="stopped"):
        worker.submit("Ada", Urgency.CLICK, lambda: 1)
