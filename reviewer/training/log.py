"""The log of a training: one line per iteration, with scores where there was a validation."""

from __future__ import annotations

import csv
from pathlib import Path

from reviewer.atomic import whole_file
from reviewer.training.loop import Step

COLUMNS = (
    "iteration",
    "loss",
    "gradient_norm",
    "lr",
    "pairs_per_s",
    "precision",
    "recall",
    "f_score",
)
Row = dict[str, str]


class Log:
    """Rows of `log.csv`; written on `flush`, together with a checkpoint."""

    def __init__(self, path: Path, iteration: int) -> None:
        """Continue a log; iterations after the last checkpoint are repeated, so their rows go."""
        self.path = path
        self.rows = [r for r in read_log(path) if int(r["iteration"]) <= iteration]

    def add(self, step: Step) -> None:
        """Add an iteration."""
        self.rows.append(
            {
                "iteration": str(step.iteration),
                "loss": f"{step.loss:.6g}",
                "gradient_norm": f"{step.gradient_norm:.4g}",
                "lr": f"{step.lr:.4g}",
                "pairs_per_s": f"{step.pairs_per_s:.2f}",
                "precision": "",
                "recall": "",
                "f_score": "",
            }
        )

    def validated(self, iteration: int, precision: float, recall: float, f_score: float) -> None:
        """Add the scores of a validation to the line of its iteration."""
        assert int(self.rows[-1]["iteration"]) == iteration
        scores = {"precision": precision, "recall": recall, "f_score": f_score}
        self.rows[-1] |= {name: f"{value:.5f}" for name, value in scores.items()}

    def flush(self) -> None:
        """Write all lines, completely or not at all."""
        lines = [",".join(COLUMNS), *(",".join(row[c] for c in COLUMNS) for row in self.rows)]
        with whole_file(self.path) as file:
            file.write(("\n".join(lines) + "\n").encode())


def read_log(path: Path) -> list[Row]:
    """Return the lines of a log; none when there is no log."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))
