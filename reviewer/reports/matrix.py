"""Train x test: what each detector was trained on, against the groups it was tested on.

The paper's "performance of each training-test pair" (figure E), from stored scores. Training: as
the store knows of the checkpoint of a run; a checkpoint from elsewhere goes by its path.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from reviewer.evaluation.table_a import Row
from reviewer.evaluation.tables import csv_text, format_rows
from reviewer.pipeline.settings import IMPORTED
from reviewer.reports.table_a_text import columns_of, row_record, table_a_cells
from reviewer.store.database import Store
from reviewer.store.runs import run_of_name
from reviewer.store.trainings import StoredTraining, list_trainings
from reviewer.words import TextFormat

NOTHING, UNKNOWN = "nothing", "unknown (imported)"


def trained_on(store: Store, run: str) -> str:
    """Return what the detector of a run was trained on."""
    found = run_of_name(store, run)
    if found.settings["detector"] == IMPORTED:
        # The run of a cross-fitting bears its name, and its nets stand below that.
        folds = [each for each in list_trainings(store) if each.name.startswith(f"{run}/")]
        return f"ground truth, {len(folds)} folds, never its own" if folds else UNKNOWN
    checkpoint = found.settings["model_settings"].get("detect", {}).get("checkpoint")
    if checkpoint is None:
        return NOTHING
    folder = Path(checkpoint).resolve().parent
    for training in list_trainings(store):
        if (store.folder / training.checkpoint).resolve().parent == folder:
            return _data_of(training)
    return str(checkpoint)


def _data_of(training: StoredTraining) -> str:
    data = training.settings["data"]
    if "fold" in data:
        return f"ground truth, fold {data['fold']}"
    splits = ", ".join(data.get("splits", ())) or "all splits"
    prefix = {"same_workspace": "workspaces of ", "others": "others than "}
    return prefix.get(data.get("train_on", ""), "") + splits


def matrix_rows(store: Store, rows: Sequence[Row]) -> list[tuple[str, Row]]:
    """Return the rows of Table A with what was trained on, sorted by that inside a variant."""
    known = [(", ".join({trained_on(store, run): None for run in row.runs}), row) for row in rows]
    variants = list(dict.fromkeys(row.variant for row in rows))
    return sorted(known, key=lambda entry: (variants.index(entry[1].variant), entry[0]))


def matrix_text(matrix: Sequence[tuple[str, Row]], form: TextFormat) -> str:
    """Write it; numbers keep all their digits in JSON and CSV."""
    rows = [row for _, row in matrix]
    if form in ("json", "csv"):
        records = [{"trained on": data, **row_record(row, rows)} for data, row in matrix]
        return format_rows(records, form) if form == "json" else csv_text(records, list(records[0]))
    return format_rows(matrix_cells(matrix), form)


def matrix_cells(matrix: Sequence[tuple[str, Row]]) -> list[dict[str, str]]:
    """Return the rows with every cell as text."""
    rows = [row for _, row in matrix]
    head = columns_of(rows)
    return [
        {"trained on": data, **dict(zip(head, cells, strict=True))}
        for (data, _), cells in zip(matrix, table_a_cells(rows), strict=True)
    ]
