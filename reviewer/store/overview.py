"""What there is to see of a pair in a run: finished stages, alignment quality, a version."""

from __future__ import annotations

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
    residual_after: float | None
    valid_fraction: float | None
    version: str


def pair_overview(store: Store, run_id: int, pair_id: int) -> Overview:
    """Return what a run has for a pair."""
    row = (
        store.read()
        .execute(
            """
            SELECT a.residual_after, a.valid_fraction, a.seconds AS a_s, d.seconds AS d_s,
                s.seconds AS s_s,
                (SELECT area FROM predictions WHERE run_id = :run AND pair_id = :pair
                    AND method = 'doi') AS area,
                (SELECT coalesce(max(u.id), 0) FROM audits u JOIN regions g ON g.id = u.region_id
                    WHERE g.run_id = :run AND g.pair_id = :pair) AS audit
            FROM (SELECT 1) LEFT JOIN alignments a ON a.run_id = :run AND a.pair_id = :pair
            LEFT JOIN detections d ON d.run_id = :run AND d.pair_id = :pair
            LEFT JOIN searches s ON s.run_id = :run AND s.pair_id = :pair
            """,
            {"run": run_id, "pair": pair_id},
        )
        .fetchone()
    )
    marks = [row["a_s"], row["d_s"], row["s_s"], row["area"]]
    done = "".join("0" if mark is None else "1" for mark in marks)
    return Overview(
        marks[0] is not None,
        marks[1] is not None,
        marks[2] is not None,
        marks[3] is not None,
        row["residual_after"],
        row["valid_fraction"],
        f"{store.identity}.{run_id}.{done}.{row['audit']}",
    )
