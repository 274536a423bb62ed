"""A person's label for what has changed: it is saved, and the pair is searched again.

Only the run's segmenter is loaded, with the first edit, and kept for the next one.
"""

from __future__ import annotations

from threading import Lock

from reviewer.errors import Conflict, ReviewerError
from reviewer.models.labellers.phrases import check_label
from reviewer.models.labellers.plain import NoLabeller
from reviewer.models.registry import build_segmenter, segmenter_reads
from reviewer.pipeline.members import Members
from reviewer.pipeline.runner import run_pipeline
from reviewer.records import Pair, Run
from reviewer.store.database import Store
from reviewer.store.regions import count_verdicts
from reviewer.store.results import edit_label


class SearchFailed(ReviewerError):
    """The label is saved, but the pair could not be searched for it."""

    status = 422


class Relabelling:
    """Edits labels of any run; one search at a time, for there is one device."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._turn = Lock()
        self._loaded: tuple[int, Members] | None = None

    def edit(self, run: Run, pair: Pair, number: int, text: str, annotator_id: int) -> None:
        """Keep a label and search the pair again, where the run's segmenter reads labels.

        Raises:
            InvalidInput: when the label is too long for a name.
            NotFound: when the pair has no label of that number in the run, nor is it the next one.
            Conflict: when people judged regions of the pair, which another search would replace.
            SearchFailed: when the search fails; the label is kept.
        """
        label = check_label(text)
        reads = "labels" in segmenter_reads(run.segmenter)
        verdicts = count_verdicts(self._store, run.id, pair.id)
        if reads and verdicts:
            raise Conflict(
                f"pair {pair.title}: people gave {verdicts} verdicts or names to its regions in run"
                f" {run.name}, which another search would replace; edit it in a run of its own"
            )
        with self._turn:
            edit_label(self._store, run.id, pair.id, number, label, annotator_id)
            if not reads:
                return
            report = run_pipeline(
                self._store,
                run,
                [pair.id],
                stages=["search", "integrate"],
                members=self._members(run),
            )
        if report.failures:
            raise SearchFailed(f"label {label!r} is kept, but {report.failures[0]}")

    def _members(self, run: Run) -> Members:
        if self._loaded is None or self._loaded[0] != run.id:
            own = run.settings.get("model_settings", {}).get("search")
            self._loaded = None  # the old one's memory is needed for the new one
            segmenter = build_segmenter(run.segmenter, own)
            self._loaded = run.id, Members(None, None, NoLabeller(), segmenter)
        return self._loaded[1]
