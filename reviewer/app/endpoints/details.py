"""Collect what the workbench needs to open a pair, without pixels."""

from __future__ import annotations

from dataclasses import asdict

from reviewer.app.endpoints.messages import (
    AlignmentInfo,
    LabelInfo,
    MaskReply,
    PairDetail,
    RegionInfo,
    RleMask,
    ScoreInfo,
    SkipInfo,
    SweepInfo,
    TruthInfo,
)
from reviewer.evaluation.counting import counts_of_pair
from reviewer.evaluation.outcomes import f_by_outcome
from reviewer.masks import empty_rle
from reviewer.metrics import Counts, f_score, precision, recall, unseen_share
from reviewer.models.registry import segmenter_reads
from reviewer.records import MaskRevision, Pair, Run, StoredRegion
from reviewer.store import runs
from reviewer.store.database import Store
from reviewer.store.layers import load_alignment, load_labels, pair_doubt
from reviewer.store.pairs import pair_of_id
from reviewer.store.regions import load_regions
from reviewer.store.reviews import review_state
from reviewer.store.revisions import newest_revision
from reviewer.store.skips import skip_of_pair
from reviewer.store.stages_done import pair_overview
from reviewer.store.sweeps import Sweep, sweep_of_pair
from reviewer.store.truth import drawn_since, list_statements, standing_of_pair
from reviewer.words import PairLayer


def choose_run(store: Store, name: str | None) -> Run | None:
    """Return the named run, or the newest; None when there is no run at all.

    Raises:
        NotFound: when the named run does not exist.
    """
    if name:
        return runs.run_of_name(store, name)
    known = runs.list_runs(store)
    return known[-1] if known else None


def truth_info(store: Store, pair_id: int) -> TruthInfo | None:
    """Return which revision counts, and on whose word; None where none does."""
    found = standing_of_pair(store, pair_id)
    if found is None:
        return None
    number, standing = found
    return TruthInfo(
        revision=number,
        standing=standing,
        said_by=[
            said.annotator
            for said in list_statements(store, pair_id)
            if (said.state, said.revision) == (standing, number)
        ],
        changed_by=drawn_since(store, pair_id, number),
    )


def pair_detail(store: Store, pair_id: int, annotator_id: int, run: Run | None) -> PairDetail:
    """Return a pair with its layers, regions and scores in a run."""
    pair = pair_of_id(store, pair_id)
    revision = newest_revision(store, pair_id)
    layers: list[PairLayer] = ["reference", "live"]
    regions: list[StoredRegion] = []
    counts: dict[str, Counts] = {}
    f_if: dict[int, dict[str, float | None]] = {}
    seen = None
    skip = skip_of_pair(store, pair_id)
    if run is not None:
        seen = pair_overview(store, run.id, pair_id)
        layers += ["warped", "difference", "unseen"] if seen.aligned else []
        layers += ["detector"] if seen.detected else []
        layers += ["objects_live", "objects_reference"] if seen.searched else []
        layers += ["doi", "prediction"] if seen.integrated else []
        regions = load_regions(store, run.id, pair_id)
        counts = {str(k): v for k, v in counts_of_pair(store, run.id, pair_id).items()}
        f_if = _f_if(store, run, pair_id, regions, counts)
    if revision is not None:
        layers.append("ground_truth")
    return PairDetail(
        id=pair.id,
        split=pair.split,
        name=pair.name,
        height=pair.live.height,
        width=pair.live.width,
        reference=pair.reference.path.name,
        live=pair.live.path.name,
        viewpoint_distance=pair.viewpoint_distance,
        revision=revision.number if revision else 0,
        state="skipped" if skip else review_state(store, pair_id, annotator_id),
        truth=truth_info(store, pair_id),
        run=run.name if run else None,
        layers=layers,
        version=seen.version if seen else "0",
        doubt=pair_doubt(store, run.id, pair_id) if run else "",
        skip=SkipInfo(annotator=skip.annotator, reason=skip.reason) if skip else None,
        alignment=_alignment_info(store, run, pair_id) if run else None,
        labels=_label_infos(store, run, pair_id) if run else [],
        reads_labels=run is not None and "labels" in segmenter_reads(run.segmenter),
        regions=[region_info(region, f_if.get(region.id, {})) for region in regions],
        sweep=sweep_info(sweep_of_pair(store, pair, annotator_id)),
        scores={method: score_info(value) for method, value in counts.items()},
    )


def newest_mask(store: Store, pair: Pair) -> MaskReply:
    """Return the newest ground truth of a pair; revision 0 and all-zero where there is none."""
    newest = newest_revision(store, pair.id)
    return mask_reply(newest) if newest else no_mask(pair)


def no_mask(pair: Pair) -> MaskReply:
    """Return what the API shows of a pair without ground truth."""
    nothing = empty_rle(pair.live.height, pair.live.width)
    return MaskReply.empty(nothing.height, nothing.width, nothing.counts)


def mask_reply(revision: MaskRevision) -> MaskReply:
    """Return a revision as the API shows it."""
    mask = revision.mask
    return MaskReply(
        revision=revision.number,
        mask=RleMask(height=mask.height, width=mask.width, counts=mask.counts),
        ignore=revision.ignore_mask.counts if revision.ignore_mask else None,
        annotator=revision.annotator,
        created_at=revision.created_at,
    )


def sweep_info(sweep: Sweep) -> SweepInfo:
    """Return what was swept as the API shows it."""
    return SweepInfo(columns=sweep.columns, rows=sweep.rows, swept=list(sweep.swept))


def _alignment_info(store: Store, run: Run, pair_id: int) -> AlignmentInfo | None:
    found = load_alignment(store, run.id, pair_id)
    if found is None:
        return None
    return AlignmentInfo(
        valid_fraction=found.valid.area / (found.valid.height * found.valid.width),
        residual_before=found.residual_before,
        residual_after=found.residual_after,
        backward_px=found.backward_px,
        doubt=found.doubt,
    )


def _label_infos(store: Store, run: Run, pair_id: int) -> list[LabelInfo]:
    return [
        LabelInfo(
            number=number,
            component=label.component,
            raw=label.raw,
            label=label.label,
            note=label.note,
            edited_by=label.edited_by,
        )
        for number, label in enumerate(load_labels(store, run.id, pair_id))
    ]


def _f_if(
    store: Store, run: Run, pair_id: int, regions: list[StoredRegion], counts: dict[str, Counts]
) -> dict[int, dict[str, float | None]]:
    now = counts.get("audited") or counts.get("doi")
    if now is None:
        return {}
    outcomes = {region.id: str(region.outcome) for region in regions}
    return f_by_outcome(store, run, pair_id, outcomes, now)


def region_info(stored: StoredRegion, f_if: dict[str, float | None]) -> RegionInfo:
    """Return a region as the API shows it: what it is, and the newest verdict on it."""
    region = stored.region
    known = {
        **asdict(region),
        **asdict(stored),
        "label": stored.labels,
        "has_object": bool(region.object_indices),
        "f_if": f_if,
    }
    return RegionInfo(**{name: known[name] for name in RegionInfo.model_fields})


def score_info(counts: Counts) -> ScoreInfo:
    """Return counts with their scores."""
    return ScoreInfo(
        tp=counts.tp,
        fp=counts.fp,
        fn=counts.fn,
        tn=counts.tn,
        precision=precision(counts),
        recall=recall(counts),
        f_score=f_score(counts),
        unseen=unseen_share(counts),
        unseen_objects=counts.unseen_objects,
    )
