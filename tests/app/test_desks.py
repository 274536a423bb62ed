"""A desk goes on where the frame that joins it says that it was."""

import pytest
from starlette.websockets import WebSocketDisconnect

from reviewer import __version__
from reviewer.app.desks import Desk, Desks
from reviewer.app.endpoints.frame_messages import Joining
from reviewer.pipeline.runner import prepare_run
from reviewer.pipeline.settings import PipelineSettings

HERE = {"Origin": "http://localhost:8000", "Host": "localhost:8000"}


def joined(db, **left):
    """Return a new desk, and what it told the frame that joined it."""
    desk, told = Desk(db), []
    desk.check_in("Ada", told.append, Joining(**{"store": db.identity, **left}))
    return desk, told[0]


def test_a_new_desk_goes_on_where_the_frame_was(db, run):
    prepare_run(db, "newer", PipelineSettings(segmenter="oversegment", detector="difference"))
    left = {"pair": 2, "run": run.name, "split": "cs1", "state": "todo", "order": "doi"}
    desk, ready = joined(db, dark=False, queue=290, **left)
    assert (ready["pair"], ready["run"]) == (2, run.name)
    assert (desk.split, desk.state, desk.order, desk.dark) == ("cs1", "todo", "doi", False)
    assert desk.queue_width == 290


def test_what_the_database_does_not_know_is_left_out(db, run):
    desk, ready = joined(db, pair=99, run="gone", split="gone")
    assert (ready["pair"], ready["run"], desk.split) == (1, run.name, None)
    _, ready = joined(db, store="another", pair=2)
    assert ready["pair"] == 1


def test_a_frame_of_another_version_can_join_all_the_same(db, run):
    desk, ready = joined(db, pair=2, state="lost", order="whim", mood="good")
    assert (ready["pair"], desk.state, desk.order) == (2, None, "name")
    assert ready["version"] == __version__


def test_a_desk_that_stands_keeps_its_filters_and_shows_the_pair_of_its_frame(db, run):
    desk, _ = joined(db, pair=2, order="doi", queue=290)
    told = []
    desk.check_in("Ada", told.append, Joining(store=db.identity, pair=3, order="size", queue=400))
    assert (told[0]["pair"], desk.order, desk.queue_width) == (3, "doi", 290)


def test_the_frame_is_told_of_filters_so_that_it_can_bring_them_back(db, run):
    told = []
    desk = Desk(db)
    desk.check_in("Ada", told.append)
    desk.filter(state="todo", team="waiting")
    filters = {"split": None, "state": "todo", "team": "waiting", "order": "name"}
    assert told[-1] == {"type": "queue", **filters}


def test_a_frame_that_joins_with_nonsense_is_told_and_sent_away(client):
    with client.websocket_connect("/api/desk?queue=wide", headers=HERE) as socket:
        assert "queue" in socket.receive_json()["detail"]
        with pytest.raises(WebSocketDisconnect) as gone:
            socket.receive_json()
        assert gone.value.code == 1008


def test_all_who_are_at_a_desk_are_told_who_else_is(db, run):
    desks = Desks(db)
    told = {name: [] for name in ("Ada", "Bob")}
    taken = {}
    for name, messages in told.items():
        _, taken[name] = desks.create()
        taken[name].check_in(name, messages.append)
        desks.enter(taken[name])
    assert told["Ada"][-1] == {"type": "here", "names": ["Ada", "Bob"]}
    desks.leave(taken["Bob"])
    assert told["Ada"][-1] == {"type": "here", "names": ["Ada"]}
    assert told["Bob"][-1] == {"type": "here", "names": ["Ada", "Bob"]}
