"""What a run has for a pair: finished stages, and a version."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from reviewer.store.database import Store


@dataclass(frozen=True, slots=True)
class Overview:
    """Finished stages of a pair in a run.

    Attributes:
        version: changes whenever a layer of the pair may look different.
    """

    aligned: bool
    detected: bool
    searched: bool
    integrated: bool
    version: str


def pair_overview(store: Store, run_id: int, pair_id: int) -> Overview:
    """Return what a run has for a pair."""
    row = (
        store.read()
        .execute(
            """
            SELECT a.pair_id AS aligned,
                (SELECT group_concat(stage || ' ' || key, ',') FROM results
                    WHERE run_id = :run AND pair_id = :pair) AS made,
                d.pair_id AS detected,
                (SELECT area FROM predictions WHERE run_id = :run AND pair_id = :pair
                    AND method = 'doi') AS area,
                (SELECT coalesce(max(u.id), 0) FROM audits u JOIN regions g ON g.id = u.region_id
                    WHERE g.run_id = :run AND g.pair_id = :pair) AS audit,
                (SELECT count(*) FROM withdrawals w JOIN audits u ON u.id = w.audit_id
                    JOIN regions g ON g.id = u.region_id
                    WHERE g.run_id = :run AND g.pair_id = :pair) AS withdrawn
            FROM (SELECT 1) LEFT JOIN alignments a ON a.run_id = :run AND a.pair_id = :pair
            LEFT JOIN detections d ON d.run_id = :run AND d.pair_id = :pair
            """,
            {"run": run_id, "pair": pair_id},
        )
        .fetchone()
    )
    made = dict(part.split(" ", 1) for part in (row["made"] or "").split(",") if part)
    digest = hashlib.sha256(f"{made}{row['area']}".encode()).hexdigest()[:12]
    return Overview(
        row["aligned"] is not None,
        row["detected"] is not None,
        "search" in made,
        row["area"] is not None,
        f"{store.identity}.{run_id}.{digest}.{row['audit']}.{row['withdrawn']}",
    )
