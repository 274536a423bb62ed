"""Which mask of a pair counts as its ground truth, with which standing, and who said so.

An approval speaks of the revision that was looked at, and of no later one. So the truth of a pair
is the newest revision somebody approved; else the newest that was submitted or confirmed empty;
else the newest imported one (the view `ground_truth`). A mask in progress counts for nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from reviewer.errors import InvalidInput
from reviewer.records import MaskRevision
from reviewer.store.database import Store
from reviewer.store.revisions import SELECT, revision_of_row
from reviewer.store.skips import NOT_SKIPPED
from reviewer.words import STANDINGS, ReviewState, Standing


@dataclass(frozen=True, slots=True)
class Statement:
    """A person's statement about a pair: which revision, in which state, when (UTC, ISO 8601)."""

    annotator: str
    state: ReviewState
    revision: int
    updated_at: str


def truth_of_pair(store: Store, pair_id: int) -> MaskRevision | None:
    """Return the revision that counts; None where nobody has finished or imported one."""
    query = SELECT.format(table="ground_truth")
    row = store.read().execute(f"{query} WHERE m.pair_id = ?", [pair_id]).fetchone()
    return revision_of_row(row) if row else None


def standing_of_pair(store: Store, pair_id: int) -> tuple[int, Standing] | None:
    """Return the number of the revision that counts, and by what; None where none does."""
    row = (
        store.read()
        .execute("SELECT number, standing FROM ground_truth WHERE pair_id = ?", [pair_id])
        .fetchone()
    )
    return (row["number"], row["standing"]) if row else None


def drawn_since(store: Store, pair_id: int, number: int) -> list[str]:
    """Return who has drawn revisions newer than `number`; "import" stands for an import."""
    rows = store.read().execute(
        "SELECT coalesce(a.name, 'import') AS name FROM mask_revisions m"
        " LEFT JOIN annotators a ON a.id = m.annotator_id"
        " WHERE m.pair_id = ? AND m.number > ? GROUP BY name ORDER BY max(m.number) DESC",
        [pair_id, number],
    )
    return [row["name"] for row in rows]


def truths(store: Store) -> dict[int, tuple[MaskRevision, Standing]]:
    """Return the revision that counts and its standing, by pair id."""
    rows = store.read().execute(SELECT.format(table="ground_truth"))
    return {row["pair_id"]: (revision_of_row(row), row["standing"]) for row in rows}


def masks_in_state(store: Store, states: Sequence[str]) -> dict[int, MaskRevision]:
    """Return by pair id the newest revision that somebody has in one of these review states.

    A mask in progress has no revision of its own to speak of: it is the newest there is.
    """
    marks = ", ".join("?" * len(states))
    rows = store.read().execute(
        f"{SELECT.format(table='mask_revisions')} JOIN (SELECT pair_id, max(CASE state"
        " WHEN 'in_progress' THEN (SELECT max(n.number) FROM mask_revisions n"
        " WHERE n.pair_id = reviews.pair_id) ELSE revision END) AS number"
        f" FROM reviews WHERE state IN ({marks}) GROUP BY pair_id) c"
        " ON c.pair_id = m.pair_id AND c.number = m.number",
        list(states),
    )
    return {row["pair_id"]: revision_of_row(row) for row in rows}


def finished_by_annotator(store: Store) -> dict[int, list[MaskRevision]]:
    """Return what each person drew last of a pair and finished, by pair id.

    Who approves what somebody else has drawn since speaks of that mask, not of an earlier own one.
    """
    rows = store.read().execute(
        f"{SELECT.format(table='mask_revisions')} JOIN reviews r ON r.pair_id = m.pair_id"
        " AND r.annotator_id = m.annotator_id AND r.state <> 'in_progress'"
        " WHERE m.number = (SELECT max(o.number) FROM mask_revisions o WHERE o.pair_id = m.pair_id"
        " AND o.annotator_id = m.annotator_id AND o.number <= r.revision)"
        " AND NOT EXISTS (SELECT 1 FROM mask_revisions b WHERE b.pair_id = m.pair_id"
        " AND b.annotator_id IS NOT m.annotator_id AND b.number > m.number"
        " AND b.number <= r.revision)"
        " ORDER BY m.pair_id, m.number"
    )
    found: dict[int, list[MaskRevision]] = {}
    for row in rows:
        found.setdefault(row["pair_id"], []).append(revision_of_row(row))
    return found


def list_statements(store: Store, pair_id: int) -> list[Statement]:
    """Return what people said of a pair, oldest first."""
    rows = store.read().execute(
        "SELECT a.name, r.state, r.revision, r.updated_at FROM reviews r"
        " JOIN annotators a ON a.id = r.annotator_id WHERE r.pair_id = ? ORDER BY r.updated_at",
        [pair_id],
    )
    return [Statement(*row) for row in rows]


def count_standings(store: Store) -> dict[Standing, int]:
    """Return how many pairs that are not skipped have a ground truth of each standing."""
    rows = store.read().execute(
        f"SELECT standing, count(*) FROM ground_truth WHERE {NOT_SKIPPED} GROUP BY standing"
    )
    counted = dict(tuple(row) for row in rows)
    return {standing: counted.get(standing, 0) for standing in STANDINGS}


def count_unfinished(store: Store) -> int:
    """Return how many pairs have masks, none of which is finished or imported."""
    (number,) = (
        store.read()
        .execute(
            f"SELECT count(*) FROM newest_revisions n WHERE n.{NOT_SKIPPED} AND NOT EXISTS"
            " (SELECT 1 FROM ground_truth t WHERE t.pair_id = n.pair_id)"
        )
        .fetchone()
    )
    return int(number)


def check_standings(given: Sequence[str], option: str) -> tuple[Standing, ...]:
    """Return the standings that a user named.

    Raises:
        InvalidInput: naming the option, for a word that is none.
    """
    for word in given:
        if word not in STANDINGS:
            known = ", ".join(STANDINGS)
            raise InvalidInput(f"{option} {word}: ground truth is never that; there are {known}")
    return tuple(standing for standing in STANDINGS if standing in given)
