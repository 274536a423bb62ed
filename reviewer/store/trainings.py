"""Which checkpoint was trained on what: one row per training, updated as it runs."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from reviewer.store.database import Store, utc_now


@dataclass(frozen=True, slots=True)
class StoredTraining:
    """A training and where it stands; `checkpoint` is relative to the database's folder."""

    name: str
    net: str
    checkpoint: str
    checkpoint_sha256: str
    settings: Mapping[str, Any]
    data_sha256: str
    seed: int
    iteration: int
    f_score: float


def save_training(store: Store, training: StoredTraining) -> None:
    """Write a training, replacing its earlier row."""
    values = [
        training.name,
        training.net,
        training.checkpoint,
        training.checkpoint_sha256,
        json.dumps(training.settings, sort_keys=True),
        training.data_sha256,
        training.seed,
        training.iteration,
        training.f_score,
        utc_now(),
    ]
    marks = ", ".join("?" * len(values))
    store.write(lambda db: db.execute(f"INSERT OR REPLACE INTO trainings VALUES ({marks})", values))


def list_trainings(store: Store) -> list[StoredTraining]:
    """Return all trainings by name."""

    def stored(row: sqlite3.Row) -> StoredTraining:
        return StoredTraining(
            row["name"],
            row["net"],
            row["checkpoint"],
            row["checkpoint_sha256"],
            json.loads(row["settings"]),
            row["data_sha256"],
            row["seed"],
            row["iteration"],
            row["f_score"],
        )

    return [stored(row) for row in store.read().execute("SELECT * FROM trainings ORDER BY name")]
