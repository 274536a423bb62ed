"""Fill docs/table-a.md: the paper's Table A on the demo world, from training to scores.

    python docs/reproduce.py            # all that is not there yet; a stopped training goes on
    python docs/reproduce.py --only cscdnet

Each detector is trained on synthetic pairs of the world's reference images alone, in about half an
hour of processor time; the world's exact masks are only used by `reviewer evaluate`. One thread
a training, so that two can run side by side; in one precision they give the same weights again.
"""

from __future__ import annotations

import argparse
import os
import resource
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np

from reviewer.dataset.files import read_rgb
from reviewer.masks import decode_rle
from reviewer.pipeline.fields import load_probability
from reviewer.records import Pair
from reviewer.store.database import Store
from reviewer.store.layers import load_detection
from reviewer.store.pairs import list_pairs
from reviewer.store.revisions import newest_revision
from reviewer.store.runs import run_of_name

ROOT = Path(__file__).resolve().parent.parent
WORLD = Path("demo-data/world-7-4")
DB = WORLD / "reviewer.db"
COMMON = (
    "--crop 192 --lr 1e-3 --class-weight 2 --validate-every 150 --validation-pairs 48"
    " --synthesis changes=0,5"
)
METHODS = {
    "dr-tanet": "dr-tanet --width 0.25 --iterations 3000 --batch 8",
    "cscdnet": "cscdnet --width 0.125 --iterations 1500 --batch 4",
    "cscdnet-attention": "cscdnet-attention --width 0.125 --iterations 1500 --batch 4",
}
TITLES = {
    "dr-tanet": "DR-TANet",
    "cscdnet": "CSCDNet",
    "cscdnet-attention": "CSCDNet + Siamese attention mask",
}
SEEDS = (0, 1)
TRAININGS = {
    f"{method}-seed{seed}" if seed else method: f"{words} {COMMON} --seed {seed}"
    for method, words in METHODS.items()
    for seed in SEEDS
}
DIFFERENCE = "dis-difference-oversegment-component"
FIRST = {"difference (no training)": DIFFERENCE, **{TITLES[m]: m for m in METHODS}}
"""One run a method, for pictures."""
SHOWN = ("cs1/0000", "cr2/0001", "hw1/0002", "lr2/0000", "cs3/0001")
CELL, RIM = (240, 180), 2
JPEG = [cv2.IMWRITE_JPEG_QUALITY, 88]


def reviewer(words: str) -> str:
    """Run a command of the program and return what it prints."""
    print(f"$ reviewer {words}", flush=True)
    command = [sys.executable, "-c", "from reviewer.cli import main; main()", *shlex.split(words)]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    return subprocess.run(
        command, cwd=ROOT, env=environment, check=True, text=True, stdout=subprocess.PIPE
    ).stdout


def train(name: str) -> None:
    """Train one detector and note how much processor time that took."""
    folder = ROOT / WORLD / "trainings" / name
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(reviewer(f"train {TRAININGS[name]} --name {name} --db {DB}"))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    times = folder / "processor-seconds.txt"
    if not times.exists():  # a second call finds the training done, and measures nothing
        times.write_text(f"{seconds:.0f}\n")


def detect(name: str) -> None:
    """Run the pipeline with a trained detector."""
    net, checkpoint = TRAININGS[name].split()[0], WORLD / "trainings" / name / "best.pt"
    print(reviewer(f"run --db {DB} --name {name} --detector {net}:{checkpoint}"))


def table() -> str:
    """Return Table A as the program prints it, and what each method was trained on."""
    words = " ".join(f"--repeat {each}" for each in _repeats())
    lines = [reviewer(f"evaluate --db {DB} --table-a {words} --format markdown").strip(), ""]
    lines += ["| | training | pairs | processor, each seed |", "|---|---|---|---|"]
    for method, title in TITLES.items():
        settings = METHODS[method].split()
        width, iterations, batch = (
            settings[settings.index(word) + 1] for word in ("--width", "--iterations", "--batch")
        )
        minutes = ", ".join(f"{_minutes(name):.1f} min" for name in _trainings(method))
        pairs = int(iterations) * int(batch)
        lines.append(f"| {title} | width {width}, {iterations} iterations | {pairs} | {minutes} |")
    return "\n".join(lines) + "\n"


def _trainings(method: str) -> list[str]:
    return [name for name in TRAININGS if name in (method, *(f"{method}-seed{s}" for s in SEEDS))]


def _repeats() -> list[str]:
    return [shlex.quote(f"{TITLES[m]}={','.join(_trainings(m))}") for m in METHODS]


def _minutes(name: str) -> float:
    times = ROOT / WORLD / "trainings" / name / "processor-seconds.txt"
    return float(times.read_text()) / 60


def pictures() -> None:
    """Write the pictures of the page: synthetic pairs, a curve, and what each detector finds."""
    sheet = ROOT / WORLD / "synthetic" / "contact-sheet.png"
    if not sheet.exists():
        reviewer(f"synth {WORLD / 'synthetic'} --count 6 --seed 5 --db {DB}")
    images = ROOT / "docs" / "images"
    cv2.imwrite(str(images / "synthetic-pairs.jpg"), cv2.imread(str(sheet)), JPEG)
    shutil.copy(ROOT / WORLD / "trainings/cscdnet/curve.png", images / "training-curve.png")
    with Store(ROOT / DB) as store:
        pairs = {pair.title: pair for pair in list_pairs(store)}
        rows = [_found(store, pairs[title]) for title in SHOWN]
    head = np.full((30, rows[0].shape[1], 3), 24, np.uint8)
    for k, title in enumerate(["live", "truth", *FIRST]):
        text = title.replace(" (no training)", "").replace(" Siamese attention", "")
        place = (8 + k * (CELL[0] + 2 * RIM), 21)
        cv2.putText(head, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.5, (225,) * 3, 1, cv2.LINE_AA)
    whole = np.vstack([head, *rows])
    cv2.imwrite(str(images / "table-a-detections.jpg"), whole[..., ::-1], JPEG)


def _found(store: Store, pair: Pair) -> np.ndarray:
    """Return a row: live, truth, and the probability map of each detector."""
    revision = newest_revision(store, pair.id)
    assert revision is not None, f"pair {pair.title} has no ground truth"
    cells = [read_rgb(pair.live.path), _grey(decode_rle(revision.mask).astype(np.float32))]
    for name in FIRST.values():
        run = run_of_name(store, name)
        detection = load_detection(store, run.id, pair.id)
        assert detection is not None, f"run {run.name} has no detection of {pair.title}"
        cells.append(_grey(load_probability(detection)))
    small = [cv2.resize(cell, CELL, interpolation=cv2.INTER_AREA) for cell in cells]
    framed = [
        cv2.copyMakeBorder(cell, RIM, RIM, RIM, RIM, cv2.BORDER_CONSTANT, value=(60,) * 3)
        for cell in small
    ]
    return np.hstack(framed)


def _grey(values: np.ndarray) -> np.ndarray:
    return np.repeat((values * 255).astype(np.uint8)[..., None], 3, axis=2)


def main() -> None:
    """Do what is not done, and write the table into its page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=TRAININGS, help="Train this one and stop.")
    only = parser.parse_args().only
    if not (ROOT / DB).exists():
        reviewer("demo --check")
        reviewer(f"run --db {DB} --detector difference --segmenter oversegment")
    if only:
        train(only)
        return
    for net in TRAININGS:
        train(net)
        detect(net)
    pictures()
    page = ROOT / "docs" / "table-a.md"
    head, _, rest = page.read_text().partition("<!-- table -->\n")
    tail = rest.partition("<!-- end -->\n")[2]
    page.write_text(f"{head}<!-- table -->\n{table()}<!-- end -->\n{tail}")
    print(f"wrote {page.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
