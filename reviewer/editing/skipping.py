"""Skip a pair that cannot be compared: a state of the pair, and a rejection of all of its regions.

Both are written in one transaction, and taken back in one.
"""

from __future__ import annotations

import sqlite3

from reviewer.editing.verdicts import ONE_AT_A_TIME, audited_mask
from reviewer.errors import InvalidInput
from reviewer.evaluation.counting import refresh_counts
from reviewer.records import Run
from reviewer.store.audits import (
    audits_of_ids,
    insert_audit,
    insert_withdrawals,
    put_audited,
    verdicts_if,
)
from reviewer.store.database import Store
from reviewer.store.pairs import pair_of_id
from reviewer.store.regions import load_regions
from reviewer.store.skips import delete_skip, insert_skip, skip_of_pair
from reviewer.words import Verdict

WHY = "bad alignment"
"""The reason that the rejections carry, as the list of reasons offers it at first."""


def skip_pair(store: Store, pair_id: int, annotator_id: int, run: Run | None, reason: str) -> None:
    """Skip a pair, for everybody; one that is skipped already stays as it is.

    Args:
        run: the regions of this run are rejected; None where there is no run.

    Raises:
        NotFound: when the pair does not exist.
        InvalidInput: when no reason is given.
    """
    pair_of_id(store, pair_id)
    if not reason.strip():
        raise InvalidInput(f"skip of pair {pair_id}: the reason must not be empty")
    with ONE_AT_A_TIME:
        if skip_of_pair(store, pair_id) is not None:
            return
        regions = load_regions(store, run.id, pair_id) if run else []
        left = [region.id for region in regions if region.verdict != "reject"]
        rejected: dict[int, Verdict | None] = dict.fromkeys(left, "reject")
        final = audited_mask(store, run.id, pair_id, rejected) if run and left else None

        def work(db: sqlite3.Connection) -> None:
            audits = [insert_audit(db, each, annotator_id, "reject", WHY, "") for each in left]
            if run and left:
                put_audited(db, run.id, pair_id, final)
            insert_skip(db, pair_id, annotator_id, reason.strip(), audits)

        store.write(work)
    refresh_counts(store, pair_id)


def lift_skip(store: Store, pair_id: int, annotator_id: int) -> None:
    """Take a pair up again, whoever skipped it; the rejections that came with it are withdrawn.

    Raises:
        NotFound: when the pair does not exist.
    """
    pair_of_id(store, pair_id)
    with ONE_AT_A_TIME:
        skip = skip_of_pair(store, pair_id)
        if skip is None:
            return
        # Those of a run that was deleted are gone with it.
        audits = [audit for audit in audits_of_ids(store, skip.audits) if audit.stands]
        ids = [audit.id for audit in audits]
        run_ids = {audit.run_id for audit in audits}
        finals = {
            run_id: audited_mask(store, run_id, pair_id, verdicts_if(store, ids, stands=False))
            for run_id in run_ids
        }

        def work(db: sqlite3.Connection) -> None:
            insert_withdrawals(db, ids, annotator_id, withdrawn=True)
            for run_id, final in finals.items():
                put_audited(db, run_id, pair_id, final)
            delete_skip(db, pair_id)

        store.write(work)
    refresh_counts(store, pair_id)
