"""Lost and found in Viser: what the run found, with pictures, searched, renamed, opened.

A name that is changed changes for every find of that name that is listed; of those without a name
only one is named at a time. The labels stay.
"""

from __future__ import annotations

import html
from typing import Any

import viser

from reviewer.app.desks import Desk
from reviewer.errors import ReviewerError
from reviewer.found.listing import NamedFind, list_named_finds, named_alike
from reviewer.found.names import UNNAMED
from reviewer.store.finds import finds_version, name_finds

ROWS = 6


class FoundPanel:
    """The tab of one Viser client; filled when it is drawn."""

    def __init__(self, client: viser.ClientHandle, desk: Desk, panel: viser.PanelHandle) -> None:
        """Build the widgets in a tab of the queue's panel."""
        self._desk = desk
        self._page = 0
        self._items: list[NamedFind] = []
        self._listed: object = None
        self._filling = False
        gui = client.gui
        with panel.add_tab("Found"):
            self._search = gui.add_text("Search", "", hint="Words of names, pairs, verdicts")
            self._summary = gui.add_html("")
            self._slots = [self._slot(client, place) for place in range(ROWS)]
            pages = gui.add_button_group("Page", ("‹", "›"))

        @self._search.on_update
        def _(_: Any) -> None:
            self._page = 0
            self.draw()

        @pages.on_click
        def _(_: Any) -> None:
            self._page += 1 if pages.value == "›" else -1
            self.draw()

    def _slot(
        self, client: viser.ClientHandle, place: int
    ) -> tuple[viser.GuiHtmlHandle, viser.GuiTextHandle, viser.GuiButtonHandle]:
        gui = client.gui
        card = gui.add_html("", visible=False)
        name = gui.add_text(
            "Name", "", visible=False, hint="Renames all finds of this name in the list"
        )
        button = gui.add_button("Open", visible=False)

        @button.on_click
        def _(_: Any) -> None:
            item = self._at(place)
            if item is not None:
                self._desk.open_pair(item.find.pair_id)

        @name.on_update
        def _(_: Any) -> None:
            item = self._at(place)
            text = " ".join(name.value.split()).lower()
            if self._filling or item is None or text == item.name:
                return
            regions = named_alike(self._items, item)
            try:
                name_finds(self._desk.store, regions, text, self._desk.author_id)
            except ReviewerError as error:
                client.add_notification("Not renamed", str(error), color="red")
            self.draw()

        return card, name, button

    def _at(self, place: int) -> NamedFind | None:
        index = self._page * ROWS + place
        return self._items[index] if index < len(self._items) else None

    def draw(self) -> None:
        """Fill the widgets with what the desk's run found."""
        desk = self._desk
        with desk.lock:
            run = desk.chosen_run
            version = None if run is None else finds_version(desk.store, run.id)
            wanted = (version, self._search.value)
            if wanted != self._listed:
                self._listed = wanted
                found = (
                    [] if run is None else list_named_finds(desk.store, run.id, self._search.value)
                )
                self._items = found
            last = max(0, (len(self._items) - 1) // ROWS)
            self._page = min(max(self._page, 0), last)
            self._summary.content = _summary(self._items, self._page, last)
            self._filling = True
            for place, (card, name, button) in enumerate(self._slots):
                item = self._at(place)
                for widget in (card, name, button):
                    widget.visible = item is not None
                if item is not None:
                    card.content = _card(item)
                    name.value = item.name  # type: ignore[misc]  # settable on the handle
                    button.label = f"Open {item.title}"
                    button.color = (46, 51, 60) if desk.dark else (226, 230, 235)
            self._filling = False


def _summary(items: list[NamedFind], page: int, last: int) -> str:
    names = len({item.name for item in items if item.name != UNNAMED})
    text = f"<b>{len(items)}</b> things, {names} names &middot; page {page + 1} of {last + 1}"
    if not items:
        text = "Nothing found. An object is listed when its mask is adopted."
    return f'<div style="padding:.4em .75em;font-size:.8em">{text}</div>'


def _card(item: NamedFind) -> str:
    seen = f"from {item.place} m" if item.place else ""
    lines = [
        ", ".join(part for part in (seen, item.when) if part),
        f"DoI {item.find.doi:.2f} &middot; {html.escape(item.verdict)}",
    ]
    facts = "".join(f"<div>{line}</div>" for line in lines if line)
    return (
        '<div style="display:flex;gap:.7em;padding:.6em .75em 0;font-size:.8em;line-height:1.5">'
        f'<img src="/api/found/{item.find.region_id}.jpg" alt="" width="88" height="88"'
        ' style="border-radius:6px;flex:none">'
        f'<div><b style="font-size:1.1em">{html.escape(item.name)}</b>'
        f'<div style="opacity:.75;font-variant-numeric:tabular-nums">{facts}</div></div></div>'
    )
