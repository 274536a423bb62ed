"""The queue: a page of pairs with state, DoI and change size, filtered and ordered in SQL."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass

from reviewer.errors import InvalidInput
from reviewer.store.database import Store
from reviewer.store.layers import DOUBT
from reviewer.words import PairState, QueueOrder, TeamState

ORDERS: dict[QueueOrder, str] = {
    "name": "split, name",
    "doi": "max_doi DESC NULLS LAST, split, name",
    "size": "change_px DESC NULLS LAST, split, name",
    "doubt": "(doubt = ''), split, name",
    "unreviewed": "done_by_others, (state <> 'todo'), split, name",
}


@dataclass(frozen=True, slots=True)
class QueueEntry:
    """A row of the queue; DoI and change size come from the chosen run, None without one.

    Attributes:
        state, team: where the pair stands for the annotator, and for the team whoever did it.
        revision, truth_px: of the newest mask, finished or not.
        doubt: why the run's results look as if the pair could not be compared, or which stage
            failed; "" = all is well.
    """

    id: int
    split: str
    name: str
    state: PairState
    team: TeamState
    revision: int
    truth_px: int | None
    change_px: int | None
    max_doi: float | None
    inspect: int
    reviewers: int
    doubt: str


@dataclass(frozen=True, slots=True)
class Progress:
    """Pairs of a split, and how many of them an annotator has finished, or somebody skipped."""

    split: str
    pairs: int
    finished: int


def list_queue(
    store: Store,
    annotator_id: int,
    *,
    run_id: int | None = None,
    split: str | None = None,
    state: PairState | None = None,
    team: TeamState | None = None,
    order: QueueOrder = "name",
    search: str = "",
    pair_ids: Sequence[int] | None = None,
    limit: int = 100,
    offset: int = 0,
) -> tuple[list[QueueEntry], int]:
    """Return a page of the queue and the number of pairs on all pages; of some pairs if named.

    A skipped pair is nothing that the team has to do: with `team` it is left out.

    Args:
        search: words that each stand in "split/name" or in the label of an object that the run
            found there; "split/7" also means the pair of that number, which then comes first.

    Raises:
        InvalidInput: when the order is unknown.
    """
    if order not in ORDERS:
        raise InvalidInput(f"queue order: {order!r} is not one of {', '.join(ORDERS)}")
    entries = f"""
    WITH entries AS (
        SELECT p.id, s.name AS split, p.name,
            CASE WHEN k.pair_id IS NULL THEN coalesce(v.state, 'todo') ELSE 'skipped' END AS state,
            coalesce(w.state, 'todo') AS team,
            (SELECT count(*) FROM reviews o WHERE o.pair_id = p.id
                AND o.state <> 'in_progress') AS reviewers,
            (SELECT count(*) FROM reviews o WHERE o.pair_id = p.id
                AND o.state <> 'in_progress' AND o.annotator_id <> :annotator) AS done_by_others,
            coalesce(t.number, 0) AS revision, t.area AS truth_px, d.area AS change_px,
            lower(s.name) || '/' || ltrim(p.name, '0') AS numbered,
            g.max_doi, coalesce(g.inspect, 0) AS inspect,
            coalesce((SELECT f.stage || ' failed: ' || f.message FROM failures f
                WHERE f.pair_id = p.id AND f.run_id = :run LIMIT 1),
                {DOUBT}) AS doubt
        FROM pairs p JOIN splits s ON s.id = p.split_id
        LEFT JOIN reviews v ON v.pair_id = p.id AND v.annotator_id = :annotator
        LEFT JOIN team_states w ON w.pair_id = p.id
        LEFT JOIN newest_revisions t ON t.pair_id = p.id
        LEFT JOIN detections d ON d.pair_id = p.id AND d.run_id = :run
        LEFT JOIN (SELECT pair_id, max(doi) AS max_doi, sum(inspect) AS inspect FROM regions
            WHERE run_id = :run GROUP BY pair_id) g ON g.pair_id = p.id
        LEFT JOIN skips k ON k.pair_id = p.id
        WHERE (:split IS NULL OR s.name = :split)
        AND (:ids IS NULL OR p.id IN (SELECT value FROM json_each(:ids)))
    ) SELECT *, count(*) OVER () AS total FROM entries
    WHERE (:state IS NULL OR state = :state)
    AND (:team IS NULL OR (team = :team AND state <> 'skipped'))
    AND NOT EXISTS (SELECT 1 FROM json_each(:words) w WHERE w.value <> numbered
        AND NOT instr(lower(split || '/' || name), w.value)
        AND NOT EXISTS (SELECT 1 FROM objects o WHERE o.pair_id = entries.id
            AND o.run_id = :run AND instr(lower(o.label), w.value)))
    """
    words = search.lower().split()
    values = {
        "annotator": annotator_id,
        "run": run_id,
        "split": split,
        "state": state,
        "team": team,
        "words": json.dumps(words),
        "first": " ".join(words),
        "ids": None if pair_ids is None else json.dumps(list(pair_ids)),
        "limit": limit,
        "offset": offset,
    }
    exact = "(:first NOT IN (numbered, lower(split || '/' || name)))"
    query = f"{entries} ORDER BY {exact}, {ORDERS[order]} LIMIT :limit OFFSET :offset"
    rows = store.read().execute(query, values).fetchall()
    found = [
        QueueEntry(
            row["id"],
            row["split"],
            row["name"],
            row["state"],
            row["team"],
            row["revision"],
            row["truth_px"],
            row["change_px"],
            row["max_doi"],
            row["inspect"],
            row["reviewers"],
            row["doubt"],
        )
        for row in rows
    ]
    if not rows and offset:
        _, total = list_queue(
            store,
            annotator_id,
            run_id=run_id,
            split=split,
            state=state,
            team=team,
            search=search,
            pair_ids=pair_ids,
            limit=1,
        )
        return [], total
    return found, rows[0]["total"] if rows else 0


def list_progress(store: Store, annotator_id: int) -> list[Progress]:
    """Return the progress of an annotator in every split."""
    rows = store.read().execute(
        "SELECT s.name, count(*) AS pairs, count(coalesce(v.pair_id, k.pair_id)) AS finished"
        " FROM pairs p LEFT JOIN skips k ON k.pair_id = p.id"
        " JOIN splits s ON s.id = p.split_id"
        " LEFT JOIN reviews v ON v.pair_id = p.id AND v.annotator_id = ?"
        " AND v.state <> 'in_progress' GROUP BY s.id ORDER BY s.name",
        [annotator_id],
    )
    return [Progress(row["name"], row["pairs"], row["finished"]) for row in rows]
