"""Write the schema down from a real database: tables, views and the comment of every column."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

from reviewer.store.database import Store

HEAD = """# Database schema

One SQLite file. Generated from a real database by `reviewer schema > db/README.md`; a test fails
when it is out of date. `sqlite-utils`, Datasette and plain SQL read it while the app runs (WAL).
Masks are COCO run-lengths with size, area and box beside them. Mask revisions and audits are
append-only; triggers refuse to change or delete them.

```bash
sqlite-utils query reviewer.db "select * from split_scores" --table
```
"""


def describe_schema() -> str:
    """Return the schema of this version as Markdown."""
    with (
        tempfile.TemporaryDirectory() as folder,
        Store(Path(folder) / "x.db", create=True) as store,
    ):
        rows = store.read().execute(
            "SELECT type, name, sql FROM sqlite_master"
            " WHERE type IN ('table', 'view') AND name NOT LIKE '\\_%' ESCAPE '\\'"
            " AND name NOT LIKE 'sqlite%' ORDER BY type, rowid"
        )
        parts = [HEAD]
        for row in rows.fetchall():
            columns = [
                (c["name"], c["type"], c["notnull"])
                for c in store.read().execute(f"PRAGMA table_info({row['name']})")
            ]
            parts.append(_section(row["type"], row["name"], row["sql"], columns))
    return "\n".join(parts).rstrip()


def _section(kind: str, name: str, sql: str, columns: list[tuple[str, str, int]]) -> str:
    first, _, rest = sql.partition("\n")
    about = first.split("--", 1)[1].strip() if "--" in first else ""
    lines = [f"## {kind} `{name}`", "", about + ".", ""]
    if kind == "view":
        lines += ["Columns: " + ", ".join(f"`{column}`" for column, _, _ in columns) + "."]
        return "\n".join([*lines, ""])
    lines += ["| column | type | |", "|---|---|---|"]
    for column, declared, required in columns:
        comment = re.search(rf"^\s*{column} (?:(?!--)[\s\S])*--\s*(.*)$", rest, re.MULTILINE)
        assert comment, f"column {name}.{column} has no comment in db/sql/"
        text = comment[1]
        null = "" if required or "NULL" in text or text == "key" else "; may be NULL"
        lines.append(f"| `{column}` | {declared} | {text}{null} |")
    return "\n".join([*lines, ""])
