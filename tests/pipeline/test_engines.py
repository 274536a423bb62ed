"""Engines do the same work: in a process, in several, on Ray; and what they do when one dies."""

import fcntl
import os
import signal
import sys
from pathlib import Path

import pytest

from reviewer.errors import InvalidInput
from reviewer.pipeline.engines.cluster import RayEngine
from reviewer.pipeline.engines.local import InProcess, Processes
from reviewer.pipeline.members import build_members
from reviewer.pipeline.runner import prepare_run, run_pipeline
from reviewer.pipeline.settings import PipelineSettings
from reviewer.pipeline.work import Known, PairTask
from reviewer.store.pairs import pair_ids
from reviewer.words import STAGES

TABLES = ("alignments", "detections", "labels", "objects", "regions", "predictions", "results")


def everything(db, run):
    """All that a run left in the store, without times and the keys of rows."""
    skipped = ("run_id", "seconds", "id")
    return {
        table: sorted(
            tuple(row[k] for k in row.keys() if k not in skipped)
            for row in db.read().execute(f"SELECT * FROM {table} WHERE run_id = ?", [run.id])
        )
        for table in TABLES
    }


def tasks(pairs):
    return [PairTask(pair, tuple((stage, "key") for stage in STAGES), Known()) for pair in pairs]


def prepared(settings=None):
    settings = settings or PipelineSettings(
        segmenter="oversegment", detector="difference", threshold=0.5
    )
    return settings, build_members(settings)


def contents(outcomes):
    return {o.pair.name: [(r.stage, r.content) for r in o.results] for o in outcomes}


@pytest.fixture
def expected(tiny_split):
    return contents(InProcess(*prepared()).outcomes(tasks(tiny_split)))


def test_threads_make_what_one_makes(tiny_split, expected):
    found = InProcess(*prepared(), threads=3).outcomes(tasks(tiny_split))
    assert contents(found) == expected


def test_tasks_are_taken_as_there_is_room(tiny_split):
    taken = []

    def source():
        for k in range(40):
            taken.append(k)
            yield tasks(tiny_split[:1])[0]

    outcomes = InProcess(*prepared(), threads=2).outcomes(source())
    next(outcomes)
    assert len(taken) <= 4
    outcomes.close()


def test_processes_make_what_one_makes_and_survive_a_pair_that_kills(
    tiny_split, expected, tmp_path
):
    victim = tiny_split[1]
    engine = Processes(prepared()[0], 2)
    killer = Killer(victim.live.path)
    killer.start()
    outcomes = list(engine.outcomes(tasks([tiny_split[1], tiny_split[0], tiny_split[2]])))
    killer.stop()
    assert len(outcomes) == 3 and killer.killed == 2
    (lost,) = (o for o in outcomes if o.failure)
    assert lost.pair.name == victim.name
    assert "the worker process died over this pair, twice" in lost.failure[1]
    whole = contents(o for o in outcomes if not o.failure)
    assert whole == {name: content for name, content in expected.items() if name != victim.name}


def test_ray_makes_what_local_makes_byte_for_byte(db, tiny_split):
    local = prepare_run(
        db, "local", PipelineSettings(segmenter="oversegment", detector="difference")
    )
    # Another setting that changes nothing here keeps the second run from taking over the first.
    ray_settings = PipelineSettings(
        segmenter="oversegment",
        detector="difference",
        model_settings={"align": {"disagreement_px": 1.5000001}},
    )
    ray_run = prepare_run(db, "ray", ray_settings)
    first = run_pipeline(db, local, pair_ids(db))
    try:
        second = run_pipeline(db, ray_run, pair_ids(db), engine="ray", workers=2)
        assert (first.done, second.done, second.failures) == (3, 3, [])
        ours, theirs = everything(db, local), everything(db, ray_run)
        ours.pop("results"), theirs.pop("results")
        assert ours == theirs
        lost_worker(db, tiny_split)
        assert os.environ["RAY_AUTH_MODE"] == "token"
    finally:
        sys.modules["ray"].shutdown()


def lost_worker(db, tiny_split):
    """A Ray worker that is killed twice over one pair: the pair is recorded, the others done."""
    victim = tiny_split[0]
    killer = Killer(victim.live.path)
    killer.start()
    outcomes = list(RayEngine(prepared()[0], 2, None).outcomes(tasks(tiny_split)))
    killer.stop()
    (lost,) = (o for o in outcomes if o.failure)
    assert (len(outcomes), lost.pair.name, killer.killed) == (3, victim.name, 2)
    assert "the Ray worker died over this pair, twice" in lost.failure[1]


def test_an_address_without_a_cluster_is_refused(db, tiny_split):
    with pytest.raises(InvalidInput, match="no Ray cluster answers"):
        RayEngine(
            PipelineSettings(segmenter="oversegment", detector="difference", threshold=0.5),
            1,
            "127.0.0.1:1",
        )


class Killer:
    """Kills whichever process opens a file, as the kernel does when memory is short.

    A lease on the file makes the kernel hold up everybody who opens it.
    """

    def __init__(self, path: Path):
        import threading

        self.killed = 0
        # Who breaks a lease sends its holder a signal that would end this process.
        self._before = signal.signal(signal.SIGIO, signal.SIG_IGN)
        self._file = os.open(path, os.O_RDWR)
        fcntl.fcntl(self._file, fcntl.F_SETLEASE, fcntl.F_WRLCK)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def start(self):
        self._thread.start()

    def stop(self):
        self._stop.set()
        self._thread.join()
        os.close(self._file)
        signal.signal(signal.SIGIO, self._before)

    def _watch(self):
        while not self._stop.wait(0.05):
            for process in self._waiting():
                os.kill(process, signal.SIGKILL)
                self.killed += 1

    def _waiting(self):
        """Workers of this test that are inside open() of the file: the one call that waits there.

        Only descendants of this process are looked at: others may wait for leases of their own.
        """
        processes = {int(e.name): e for e in Path("/proc").iterdir() if e.name.isdigit()}
        return [pid for pid, entry in processes.items() if is_ours(pid) and waits(entry)]


def is_ours(pid):
    """Say whether a process descends from this one."""
    while pid > 1:
        try:
            status = (Path("/proc") / str(pid) / "status").read_text()
        except OSError:
            return False
        pid = int(next(line for line in status.splitlines() if line.startswith("PPid:")).split()[1])
        if pid == os.getpid():
            return True
    return False


def waits(entry):
    """Say whether a thread of a process waits for a lease to be given back."""
    try:
        threads = list((entry / "task").iterdir())
        return any("break_lease" in (thread / "wchan").read_text() for thread in threads)
    except OSError:
        return False
