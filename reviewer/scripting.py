"""A database as a notebook sees it: pairs, runs and scores, masks and pictures as arrays.

Nothing here writes. It reads while the app runs and while a pipeline writes; what is loaded is what
was there at that moment.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any

from reviewer.dataset.pictures import read_picture
from reviewer.errors import NotFound
from reviewer.masks import Mask, decode_rle
from reviewer.models.interfaces import Field, Image
from reviewer.pipeline.fields import load_confidence, load_flow, load_probability
from reviewer.pipeline.stored import warped_reference
from reviewer.records import Pair, Run, StoredRegion
from reviewer.store.database import Store
from reviewer.store.layers import (
    StoredAlignment,
    load_alignment,
    load_detection,
    load_labels,
    load_objects,
)
from reviewer.store.pairs import list_pairs
from reviewer.store.regions import load_final_mask, load_prediction, load_regions
from reviewer.store.runs import list_runs, run_of_name
from reviewer.store.truth import truth_of_pair
from reviewer.words import PredictionKind


@dataclass(frozen=True, slots=True)
class FoundObject:
    """An object of a run: side "live" or "reference", bool (H, W) in the live frame."""

    side: str
    label: str
    score: float
    mask: Mask


@dataclass(frozen=True, slots=True)
class PairData:
    """A pair; its arrays are loaded on demand.

    Attributes:
        pair: names, paths, poses, sizes; `pair.title` is "split/name".
    """

    pair: Pair
    _store: Store = field(repr=False)

    @property
    def title(self) -> str:
        """The pair's name, "split/name"."""
        return self.pair.title

    def live(self) -> Image:
        """Return the live image, uint8 RGB (H, W, 3)."""
        return read_picture(self.pair.live)

    def reference(self) -> Image:
        """Return the reference as it was taken, uint8 RGB (h, w, 3)."""
        return read_picture(self.pair.reference)

    def warped(self, run: str) -> tuple[Image, Mask]:
        """Return the reference warped to live, uint8 RGB (H, W, 3), and where it is valid.

        Raises:
            NotFound: when the run did not align the pair.
        """
        return warped_reference(self._store, self._run(run), self.pair)

    def confidence(self, run: str) -> Field | None:
        """Return how sure the alignment is, float32 (H, W) in [0, 1]; None where its aligner does
        not say.

        Raises:
            NotFound: when the run did not align the pair.
        """
        return load_confidence(self._alignment(run))

    def flow(self, run: str) -> Field:
        """Return the alignment, float32 (H, W, 2): live pixel to reference pixel.

        Raises:
            NotFound: when the run did not align the pair.
        """
        return load_flow(self._alignment(run))

    def truth(self) -> Mask | None:
        """Return the ground truth that counts, bool (H, W); None without any.

        It is what was approved, else submitted or confirmed empty, else imported; a mask that is
        still being drawn is none.
        """
        revision = truth_of_pair(self._store, self.pair.id)
        return decode_rle(revision.mask) if revision else None

    def ignore(self) -> Mask | None:
        """Return the pixels that are not scored, bool (H, W); None where there are none."""
        revision = truth_of_pair(self._store, self.pair.id)
        return revision.ignore() if revision else None

    def probability(self, run: str) -> Field | None:
        """Return the detector's map, float32 (H, W) in [0, 1]; None where it gave a mask only.

        Raises:
            NotFound: when the run has no detection of the pair.
        """
        found = load_detection(self._store, self._run(run).id, self.pair.id)
        if found is None:
            raise NotFound(f"pair {self.title}: no detection in run {run}")
        return load_probability(found)

    def prediction(self, run: str, which: PredictionKind = "final") -> Mask | None:
        """Return a mask of a run, bool (H, W); None where it has none.

        Args:
            which: "base" = M_o, "doi" = with DoI, "audited" = after verdicts, "final" = the last
                of these that is there.
        """
        key = self._run(run).id
        if which == "final":
            rle = load_final_mask(self._store, key, self.pair.id)
        else:
            rle = load_prediction(self._store, key, self.pair.id, which)
        return decode_rle(rle) if rle else None

    def objects(self, run: str) -> list[FoundObject]:
        """Return the objects of a run, live ones first."""
        return [
            FoundObject(found.side, found.label, found.score, decode_rle(found.mask))
            for found in load_objects(self._store, self._run(run).id, self.pair.id)
        ]

    def regions(self, run: str) -> list[StoredRegion]:
        """Return the regions of a run: the terms of DoI, the decision, the newest verdict."""
        return load_regions(self._store, self._run(run).id, self.pair.id)

    def labels(self, run: str) -> list[str]:
        """Return what was searched for, without empty labels."""
        found = load_labels(self._store, self._run(run).id, self.pair.id)
        return [label.label for label in found if label.label]

    def _alignment(self, run: str) -> StoredAlignment:
        found = load_alignment(self._store, self._run(run).id, self.pair.id)
        if found is None:
            raise NotFound(f"pair {self.title}: not aligned in run {run}")
        return found

    def _run(self, name: str) -> Run:
        return run_of_name(self._store, name)


class Project:
    """An open database; close it when done, or use `with`."""

    def __init__(self, store: Store) -> None:
        """Take an open store; `reviewer.open` makes one."""
        self._store = store

    def __enter__(self) -> Project:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the database."""
        self._store.close()

    def pairs(self, *splits: str) -> list[PairData]:
        """Return pairs by split and name; of all splits when none are named.

        Raises:
            NotFound: when a split does not exist.
        """
        return [PairData(pair, self._store) for pair in list_pairs(self._store, splits)]

    def pair(self, title: str) -> PairData:
        """Return the pair "split/name".

        Raises:
            NotFound: when there is none of that name.
        """
        split, _, name = title.partition("/")
        found = next((p for p in list_pairs(self._store, [split]) if p.name == name), None)
        if found is None:
            raise NotFound(f"pair {title}: does not exist")
        return PairData(found, self._store)

    def runs(self) -> list[Run]:
        """Return all runs with their settings, oldest first."""
        return list_runs(self._store)

    def query(self, sql: str, values: Sequence[Any] = ()) -> list[dict[str, Any]]:
        """Return the rows of a query as dictionaries: `pandas.DataFrame(project.query(...))`.

        The connection is read-only; db/README.md names tables and views.
        """
        return [dict(row) for row in self._store.read().execute(sql, list(values))]


def open_project(path: str | Path) -> Project:
    """Open a database for reading.

    Raises:
        NotFound: when the file does not exist.
        InvalidInput: when it is no database of this program, or a newer one.
    """
    return Project(Store(Path(path)))
