"""The list as a self-contained page with pictures and a search field; needs no server."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence

from reviewer.found.listing import NamedFind
from reviewer.found.names import UNNAMED
from reviewer.found.thumbnails import draw_thumbnail
from reviewer.store.database import Store

STYLE = """
:root { color-scheme: light dark; --line: #8884; --soft: #888; }
body { font: 15px/1.45 system-ui, sans-serif; max-width: 1180px; margin: 0 auto; padding: 24px; }
h1 { font-size: 22px; margin: 0 0 2px; } p { color: var(--soft); margin: 0 0 16px; }
input { width: 100%; box-sizing: border-box; font: inherit; padding: 8px 12px;
  border: 1px solid var(--line); border-radius: 8px; margin-bottom: 18px; }
ul { display: grid; grid-template-columns: repeat(auto-fill, minmax(176px, 1fr)); gap: 16px;
  list-style: none; padding: 0; margin: 0; }
li { border: 1px solid var(--line); border-radius: 10px; overflow: hidden; }
img { display: block; width: 100%; aspect-ratio: 1; object-fit: cover; background: #181818; }
div { padding: 8px 12px 10px; } b { display: block; overflow-wrap: anywhere; }
span { display: block; color: var(--soft); font-size: 13px; font-variant-numeric: tabular-nums; }
"""
SCRIPT = """
const field = document.querySelector("input"), items = [...document.querySelectorAll("li")];
field.oninput = () => {
  const words = field.value.toLowerCase().split(/\\s+/).filter(Boolean);
  for (const item of items) {
    const text = item.textContent.toLowerCase();
    item.hidden = !words.every((word) => text.includes(word));
  }
};
"""


def found_page(store: Store, run: str, items: Sequence[NamedFind]) -> str:
    """Return the page of a list; pictures are read from the images of the database."""
    names = {item.name for item in items} - {UNNAMED}
    counted = (
        f"{len(items)} thing{'s' * (len(items) != 1)}, {len(names)} name{'s' * (len(names) != 1)}"
    )
    cards = "\n".join(_card(store, item) for item in items) or "<li><div>nothing</div></li>"
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Lost and found · {html.escape(run)}</title><style>{STYLE}</style></head>
<body><h1>Lost and found</h1>
<p>{counted}, found by run {html.escape(run)}</p>
<input type="search" placeholder="Search names, splits, verdicts…" aria-label="Search">
<ul>
{cards}
</ul><script>{SCRIPT}</script></body></html>
"""


def _card(store: Store, item: NamedFind) -> str:
    picture = base64.b64encode(draw_thumbnail(store, item.find)).decode()
    seen = f"seen from {item.place} m" if item.place else ""
    lines = [
        item.title,
        ", ".join(part for part in (seen, item.when) if part),
        f"DoI {item.find.doi:.2f}, {item.verdict}",
    ]
    facts = "".join(f"<span>{html.escape(line)}</span>" for line in lines if line)
    return (
        f'<li><img alt="" src="data:image/jpeg;base64,{picture}">'
        f"<div><b>{html.escape(item.name)}</b>{facts}</div></li>"
    )
