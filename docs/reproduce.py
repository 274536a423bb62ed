"""Fill docs/table-a.md: the paper's Table A on the demo world, from training to scores.

    python docs/reproduce.py            # all that is not there yet; a stopped training goes on
    python docs/reproduce.py --only cscdnet

Each detector is trained on synthetic pairs of the world's reference images alone, in at most 30
minutes of processor time; the world's exact masks are only used by `reviewer evaluate`. One thread
a training, so that two can run side by side and give the same weights wherever they run.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shlex
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WORLD = Path("demo-data/world-7-4")
DB = WORLD / "reviewer.db"
COMMON = (
    "--crop 192 --lr 1e-3 --class-weight 2 --validate-every 150 --validation-pairs 48"
    " --synthesis changes=0,5"
)
TRAININGS = {
    "cscdnet": f"--width 0.125 --iterations 1500 --batch 4 {COMMON}",
    "dr-tanet": f"--width 0.25 --iterations 3000 --batch 8 {COMMON}",
    "cscdnet-attention": f"--width 0.125 --iterations 1500 --batch 4 {COMMON}",
}
TITLES = {
    "difference": "difference (no training)",
    "dr-tanet": "DR-TANet",
    "cscdnet": "CSCDNet",
    "cscdnet-attention": "CSCDNet + Siamese attention mask",
}
DIFFERENCE = "dis-difference-oversegment-component"


def reviewer(words: str) -> str:
    """Run a command of the program and return what it prints."""
    print(f"$ reviewer {words}", flush=True)
    command = [sys.executable, "-c", "from reviewer.cli import main; main()", *shlex.split(words)]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    return subprocess.run(
        command, cwd=ROOT, env=environment, check=True, text=True, stdout=subprocess.PIPE
    ).stdout


def train(net: str) -> None:
    """Train one detector and note how much processor time that took."""
    folder = ROOT / WORLD / "trainings" / net
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(reviewer(f"train {net} --db {DB} {TRAININGS[net]}"))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    times = folder / "processor-seconds.txt"
    if not times.exists():  # a second call finds the training done, and measures nothing
        times.write_text(f"{seconds:.0f}\n")


def detect(net: str) -> None:
    """Run the pipeline with a trained detector."""
    checkpoint = WORLD / "trainings" / net / "best.pt"
    print(reviewer(f"run --db {DB} --name {net} --detector {net}:{checkpoint}"))


def table() -> str:
    """Return the page: commands, table, scores by split."""
    lines = json.loads(reviewer(f"evaluate --db {DB} --format json"))
    score = {(line["run"], line["method"], line["split"]): line for line in lines}
    runs = {net: DIFFERENCE if net == "difference" else net for net in TITLES}
    rows = [
        "| | without DoI | with DoI | training | pairs | processor |",
        "|---|---|---|---|---|---|",
    ]
    for net, title in TITLES.items():
        cells = [f"{score[runs[net], method, 'mean']['f_score']:.4f}" for method in ("base", "doi")]
        trained = ["-", "-", "-"]
        if net in TRAININGS:
            words = TRAININGS[net].split()
            iterations, batch = (words[words.index(w) + 1] for w in ("--iterations", "--batch"))
            times = ROOT / WORLD / "trainings" / net / "processor-seconds.txt"
            minutes = float(times.read_text()) / 60
            width = words[words.index("--width") + 1]
            trained = [f"width {width}, {iterations} iterations"]
            trained += [str(int(iterations) * int(batch)), f"{minutes:.1f} min"]
        rows.append("| " + " | ".join([title, *cells, *trained]) + " |")
    splits = sorted({line["split"] for line in lines} - {"mean"})
    rows += ["", "F by split, without / with DoI:", "", "| | " + " | ".join(splits) + " |"]
    rows.append("|---" * (len(splits) + 1) + "|")
    for net, title in TITLES.items():
        cells = [
            " / ".join(f"{score[runs[net], m, split]['f_score']:.2f}" for m in ("base", "doi"))
            for split in splits
        ]
        rows.append("| " + " | ".join([title, *cells]) + " |")
    return "\n".join(rows) + "\n"


def main() -> None:
    """Do what is not done, and write the table into its page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=TRAININGS, help="Train this one and stop.")
    only = parser.parse_args().only
    if not (ROOT / DB).exists():
        reviewer("demo --check")
    if only:
        train(only)
        return
    for net in TRAININGS:
        train(net)
        detect(net)
    page = ROOT / "docs" / "table-a.md"
    head, _, rest = page.read_text().partition("<!-- table -->\n")
    tail = rest.partition("<!-- end -->\n")[2]
    page.write_text(f"{head}<!-- table -->\n{table()}<!-- end -->\n{tail}")
    print(f"wrote {page.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
