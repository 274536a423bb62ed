"""The Viser shell: one locked client per browser window, unlocked by its workbench frame.

A client that connects shows the place of a frame and nothing else. When the frame has checked in
with a signed-in session, the queue and the map of its annotator appear. Nothing is ever put on the
server scope of Viser, because that reaches every socket.
"""

from __future__ import annotations

import contextlib
import io
import os
from collections.abc import Callable

import viser
from viser import _messages as viser_messages

from reviewer.app.desks import Desk, Desks
from reviewer.app.panels.found import FoundPanel
from reviewer.app.panels.map import MapPanel
from reviewer.app.panels.plan import PlanPanel
from reviewer.app.panels.queue import QueuePanel
from reviewer.app.panels.scores import ScoresPanel
from reviewer.app.panels.whatif import WhatIfPanel

ACCENT = (20, 130, 140)
QUEUE_WIDTH = 216


class Shell:
    """Owns the Viser server and the clients' panels."""

    def __init__(self, desks: Desks) -> None:
        """Start Viser on a free loopback port."""
        self._desks = desks
        self._nonces: dict[int, str] = {}
        os.environ.pop("_VISER_PORT_OVERRIDE", None)
        # Viser greets on stdout with a port that nobody should open.
        with contextlib.redirect_stdout(io.StringIO()):
            self._server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        # A client could ask Viser to open a public tunnel; ours must not.
        for message in (viser_messages.ShareUrlRequest, viser_messages.ShareUrlDisconnect):
            self._server._websock_server.unregister_handler(message)
        self._server.on_client_connect(self._connect)
        self._server.on_client_disconnect(self._disconnect)

    @property
    def port(self) -> int:
        """The loopback port that Viser listens on."""
        return int(self._server.get_port())

    def stop(self) -> None:
        """Stop Viser."""
        with contextlib.redirect_stdout(io.StringIO()):
            self._server.stop()

    def _connect(self, client: viser.ClientHandle) -> None:
        nonce, desk = self._desks.create()
        self._nonces[client.client_id] = nonce
        _theme(client, dark=desk.dark)
        panel = client.gui.add_panel()
        # Before the frame is there: it may check in at once.
        desk.redraw = _drawer(client, desk, panel)
        with panel.add_tab("Workbench", viser.Icon.BRUSH):
            # The frame lies over this place (static/js/shell): it outlives what Viser draws.
            client.gui.add_html(f'<div class="workbench-place" data-client="{nonce}"></div>')
        with panel.add_tab("Map", viser.Icon.MAP_2):
            client.gui.add_html('<div class="map-place"></div>')
        # Styles give it all that the drawer leaves.
        panel.dock_right()

    def _disconnect(self, client: viser.ClientHandle) -> None:
        nonce = self._nonces.pop(client.client_id, None)
        if nonce:
            self._desks.remove(nonce)


def _drawer(
    client: viser.ClientHandle, desk: Desk, workbench: viser.PanelHandle
) -> Callable[[str], None]:
    """Return the function that redraws a client after a change of its desk."""
    panels: list[tuple[QueuePanel, MapPanel, FoundPanel, PlanPanel, WhatIfPanel]] = []

    def draw(what: str) -> None:
        with desk.lock:
            if what in ("unlock", "theme"):
                _theme(client, dark=desk.dark)
            if not panels:
                queue = QueuePanel(client, desk)
                queue.panel.dock_left()
                queue.panel.set_width(desk.queue_width or QUEUE_WIDTH)
                found = FoundPanel(client, desk, queue.panel)
                plan = PlanPanel(client, desk, queue.panel)
                rules = WhatIfPanel(client, desk, workbench)
                ScoresPanel(client, desk, workbench)
                panels.append((queue, MapPanel(client, desk), found, plan, rules))
            for queue, scene, found, plan, rules in panels:
                rules.forget()
                queue.draw(follow=what != "change")
                scene.draw()
                plan.follow()
                if what != "pair":
                    found.draw()
            client.flush()

    return draw


def _theme(client: viser.ClientHandle, *, dark: bool) -> None:
    client.gui.configure_theme(
        dark_mode=dark,
        show_logo=False,
        show_share_button=False,
        brand_color=ACCENT,
        control_width="small",
    )
