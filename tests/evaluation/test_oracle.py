"""The oracle: no rule of its scope has a higher F in any split, and no decisions have."""

import itertools

import numpy as np
import pytest
from doi_scenes import scene
from hypothesis import given, settings
from hypothesis import strategies as st

from reviewer.evaluation.rules import Rule
from reviewer.evaluation.terms import ObjectTerms, PairTerms, pair_terms
from reviewer.evaluation.whatif import WhatIf
from reviewer.masks import crop_to_box

SCOPES = ("component", "image")
SEEN = ("keep", "reject")


def terms_of(seed):
    change, live, past, valid, truth, ignore = scene(seed)
    reference = np.logical_or.reduce([np.zeros_like(change), *past])
    return pair_terms(change, [crop_to_box(m) for m in live], reference, valid, truth, ignore)


def best_of_all(pairs, scope, seen):
    """The highest F of one split, by trying every decision of every region."""
    options = []
    for terms in pairs:
        regions = [tuple(range(len(terms.objects)))] if scope == "image" else [
            (k,) for k in range(len(terms.objects))
        ]  # fmt: skip
        if not terms.components or not terms.objects:
            regions = []
        outcomes = ("keep", "adopt", "reject") if seen == "reject" else ("keep", "adopt")
        options.append({
            counts_of(terms, regions, chosen, scope)
            for chosen in itertools.product(outcomes, repeat=len(regions))
        })  # fmt: skip
    truth = sum(terms.truth_px for terms in pairs)
    sums = {(0, 0)}
    for found in options:
        sums = {(tp + a, fp + b) for tp, fp in sums for a, b in found}
    return max(2 * tp / (tp + fp + truth) if tp + fp + truth else 0.0 for tp, fp in sums)


def counts_of(terms, regions, chosen, scope):
    gone, adopted = set(), set()
    for objects, outcome in zip(regions, chosen, strict=True):
        if outcome == "keep":
            continue
        if scope == "image":
            gone.update(range(len(terms.components)))
        else:
            gone.update(terms.objects[objects[0]].components)
        if outcome == "adopt":
            adopted.update(objects)
    kept = [c for k, c in enumerate(terms.components) if k not in gone]
    held = [(tp, fp) for members, tp, fp in terms.atoms if adopted.intersection(members)]
    return tuple(int(v) for v in np.array([(0, 0), *kept, *held]).sum(axis=0))


@pytest.mark.parametrize("seen", SEEN)
@pytest.mark.parametrize("scope", SCOPES)
@pytest.mark.parametrize("seeds", [(0, 1), (2, 5), (7, 8), (10, 13), (14, 20)])
def test_no_decisions_have_a_higher_f(seeds, scope, seen):
    pairs = [terms_of(seed) for seed in seeds]
    oracle = WhatIf([("a", terms) for terms in pairs]).oracle(scope, seen)
    assert oracle.f_scores()[0, 0] == pytest.approx(best_of_all(pairs, scope, seen), abs=1e-12)


pixels = st.integers(0, 60)
iou = st.floats(0, 1, allow_nan=False)


@st.composite
def made_terms(draw):
    """Components, objects and atoms that need not come from any picture."""
    parts = draw(st.lists(st.tuples(pixels, pixels), max_size=4))
    places = st.lists(st.integers(0, max(0, len(parts) - 1)), unique=True, max_size=len(parts))
    objects = [
        ObjectTerms(draw(iou), draw(st.integers(-1, 4)), tuple(sorted(draw(places))))
        for _ in range(draw(st.integers(0, 4)))
    ]
    atoms = [((k,), draw(pixels), draw(pixels)) for k in range(len(objects))]
    if len(objects) > 1:
        atoms.append(((0, len(objects) - 1), draw(pixels), draw(pixels)))
    whole = ObjectTerms(draw(iou), draw(st.integers(-1, 4)), tuple(range(len(parts))))
    least = sum(tp for tp, _ in parts) + sum(tp for _, tp, _ in atoms)
    return PairTerms(
        draw(st.integers(least, least + 200)),
        tuple(parts),
        tuple(objects),
        tuple(atoms),
        whole if objects else None,
    )


rules = st.builds(
    Rule,
    st.floats(0, 0.4),
    st.floats(0.4, 1.1),
    st.integers(0, 3),
    st.sampled_from(SCOPES),
    st.sampled_from(["best", "all"]),
    st.sampled_from(SEEN),
)


@settings(max_examples=60, deadline=None)
@given(
    pairs=st.lists(st.tuples(st.sampled_from("ab"), made_terms()), min_size=1, max_size=5),
    rule=rules,
)
def test_no_rule_of_its_scope_beats_the_oracle_in_any_split(pairs, rule):
    engine = WhatIf(pairs)
    oracle = engine.oracle(rule.scope, rule.seen).f_scores()[0]
    assert (oracle >= engine.sweep([rule]).f_scores()[0] - 1e-12).all()
    assert (oracle >= engine.base().f_scores()[0] - 1e-12).all()


def test_an_oracle_that_may_reject_is_never_worse_than_one_that_may_not():
    engine = WhatIf([("ab"[seed % 2], terms_of(seed)) for seed in range(12)])
    for scope in SCOPES:
        keep, reject = (engine.oracle(scope, seen).f_scores()[0] for seen in SEEN)
        assert (reject >= keep).all() and (reject > keep).any()


def test_the_highest_f_may_need_more_wrong_pixels():
    # Kept: nothing of 100 found, 100 wrong. Adopted: 50 found, 60 besides: 110 wrong, F .476.
    thing = ObjectTerms(0.5, 0, (0,))
    terms = PairTerms(100, ((0, 1),), (thing,), (((0,), 50, 60),), thing)
    for scope in SCOPES:
        oracle = WhatIf([("a", terms)]).oracle(scope)
        assert (oracle.tp[0, 0], oracle.fp[0, 0]) == (50, 60)
