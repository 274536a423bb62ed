"""Scores under other DoI rules, without touching a mask: thresholds, tolerance, scope.

A hundred rules over all pairs are a few matrix operations on the integers of `terms`. Decisions are
those of `doi.integrate`, the best-object rule included; a test holds the two together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reviewer.evaluation.oracle import Links, best_decisions, highest_f
from reviewer.evaluation.rules import Rule
from reviewer.evaluation.term_arrays import (
    AtomArrays,
    Bools,
    EquationArrays,
    Floats,
    Ints,
    PartArrays,
    Touching,
    sum_by,
)
from reviewer.evaluation.terms import PairTerms
from reviewer.metrics import Counts
from reviewer.words import Scope, Seen


@dataclass(frozen=True, slots=True)
class Sweep:
    """Counts of every rule pooled over each split: int64 (rules, splits)."""

    splits: tuple[str, ...]
    tp: Ints
    fp: Ints
    truth_px: Ints

    def f_scores(self) -> Floats:
        """Return F, float64 (rules, splits); 0 where nothing is there and nothing was found."""
        found = self.tp + self.fp + self.truth_px
        return np.where(found > 0, 2 * self.tp / np.maximum(found, 1), 0.0)

    def mean_f(self) -> Floats:
        """Return the unweighted mean over splits, float64 (rules,)."""
        return np.asarray(self.f_scores().mean(axis=1))


class WhatIf:
    """The terms of many pairs as arrays; built once, queried often."""

    def __init__(self, pairs: Sequence[tuple[str, PairTerms]]) -> None:
        """Take (split, terms) of every pair."""
        self.splits = tuple(sorted({split for split, _ in pairs}))
        place = {split: k for k, split in enumerate(self.splits)}
        self._pair_split = np.array([place[split] for split, _ in pairs], np.int64)
        terms = [terms for _, terms in pairs]
        self._truth_px = np.array([t.truth_px for t in terms], np.int64)
        self._truth = self._pool(self._truth_px[None])[0]
        self._pairs = len(pairs)
        self._parts = PartArrays(terms)
        self._objects = EquationArrays([(k, o) for k, t in enumerate(terms) for o in t.objects])
        self._images = EquationArrays([(k, t.image) for k, t in enumerate(terms) if t.image])
        self._atoms = AtomArrays(terms)
        has_parts = np.array([bool(t.components) for t in terms], np.bool_)
        self._in_play = has_parts[self._objects.pair]
        self._image_in_play = has_parts[self._images.pair]
        self._holds = Touching(terms)
        self._oracles: dict[tuple[Scope, Seen], Sweep] = {}

    def sweep(self, rules: Sequence[Rule]) -> Sweep:
        """Return the counts of every rule."""
        return Sweep(self.splits, *self._counts(*self._decided(rules)), self._truth)

    def counts_by_pair(self, rule: Rule) -> list[Counts]:
        """Return TP, FP and FN of every pair under a rule, in the order of the pairs."""
        tp, fp = self._by_pair(*self._decided([rule]))
        return [
            Counts(int(right), int(wrong), int(there - right))
            for right, wrong, there in zip(tp[0], fp[0], self._truth_px, strict=True)
        ]

    def changed_pairs(self, first: Rule, second: Rule) -> Ints:
        """Return the indices of the pairs whose masks differ between two rules, ascending."""
        adopted, kept = self._decided([first, second])
        objects = self._objects.pair[adopted[0] != adopted[1]]
        parts = self._parts.pair[kept[0] != kept[1]]
        return np.unique(np.concatenate([objects, parts]))

    def _decided(self, rules: Sequence[Rule]) -> tuple[Bools, Bools]:
        """Return the objects that are adopted and the components that are kept, by rule."""
        adopted = np.zeros((len(rules), len(self._objects.pair)), np.bool_)
        kept = np.ones((len(rules), len(self._parts.pair)), np.bool_)
        by_object = [k for k, rule in enumerate(rules) if rule.scope == "component"]
        by_image = [k for k, rule in enumerate(rules) if rule.scope == "image"]
        if by_object:
            some = [rules[k] for k in by_object]
            adopted[by_object] = self.adopted(some)
            gone = adopted[by_object] | self._objects.rejected(some)
            kept[by_object] = ~self._holds.touched(gone, kept.shape[1])
        if by_image:
            some = [rules[k] for k in by_image]
            pairs, gone = np.zeros((2, len(by_image), self._pairs), np.bool_)
            pairs[:, self._images.pair] = self._images.adoptable(some) & self._image_in_play
            gone[:, self._images.pair] = self._images.rejected(some)
            adopted[by_image] = pairs[:, self._objects.pair]
            kept[by_image] = ~(pairs | gone)[:, self._parts.pair]
        return adopted, kept

    def base(self) -> Sweep:
        """Return the counts of the detector alone."""
        adopted = np.zeros((1, len(self._objects.pair)), np.bool_)
        kept = np.ones((1, len(self._parts.pair)), np.bool_)
        return Sweep(self.splits, *self._counts(adopted, kept), self._truth)

    def oracle(self, scope: Scope = "component", seen: Seen = "keep") -> Sweep:
        """Return the counts of the decisions with the highest F in every split.

        What is decided freely is what a rule of this scope decides: under `component` every object
        (adopt it, or keep the components that it touches), under `image` every pair with objects
        and a detection (adopt all of its objects, or keep M_o). With seen = "reject" the same
        components may also go without anything in their place. So no rule of the scope and of
        `seen` has a higher F in any split; see `oracle.highest_f`.
        """
        if (scope, seen) not in self._oracles:
            choose = self._best_objects if scope == "component" else self._best_images
            known = self.sweep([Rule(scope=scope, high=0.0), Rule(scope=scope, seen=seen)])
            start = known.f_scores().argmax(axis=0)[None]
            tp, fp = highest_f(
                lambda rate, waiting: choose(rate, waiting, seen == "reject"),
                self._truth,
                *(np.take_along_axis(sums, start, axis=0)[0] for sums in (known.tp, known.fp)),
            )
            self._oracles[scope, seen] = Sweep(self.splits, tp[None], fp[None], self._truth)
        return self._oracles[scope, seen]

    def _best_objects(self, rate: Floats, waiting: Bools, may_reject: bool) -> tuple[Ints, Ints]:
        free = self._in_play & waiting[self._pair_split[self._objects.pair]]
        links = Links(self._holds.links(), self._atoms.links(), free)
        gains = [
            (2 - price) * things.tp - price * things.fp
            for things in (self._parts, self._atoms)
            for price in (rate[self._pair_split[things.pair]],)
        ]
        adopted, kept = best_decisions(links, gains[0], gains[1], may_reject)
        tp, fp = self._counts(adopted[None], kept[None])
        return tp[0], fp[0]

    def _best_images(self, rate: Floats, waiting: Bools, may_reject: bool) -> tuple[Ints, Ints]:
        del waiting  # all pairs are quickly decided
        free = np.zeros(self._pairs, np.bool_)
        free[self._images.pair] = self._image_in_play
        everything = np.ones((1, len(self._objects.pair)), np.bool_)
        parts = np.ones((1, len(self._parts.pair)), np.bool_)
        tp, fp = self._by_pair(~everything, parts)
        options = [(tp[0], fp[0])]
        tp, fp = self._by_pair(everything, ~parts)
        options.append((np.where(free, tp[0], options[0][0]), np.where(free, fp[0], options[0][1])))
        if may_reject:
            options.append((np.where(free, 0, options[0][0]), np.where(free, 0, options[0][1])))
        tps, fps = (np.stack([option[k] for option in options]) for k in (0, 1))
        price = rate[self._pair_split]
        best = np.argmax((2 - price) * tps - price * fps, axis=0)[None]
        tp, fp = (np.take_along_axis(values, best, axis=0) for values in (tps, fps))
        return self._pool(tp)[0], self._pool(fp)[0]

    def adopted(self, rules: Sequence[Rule]) -> Bools:
        """Return which objects every rule adopts, bool (rules, objects); scope `component`."""
        return self._settle(self._objects.adoptable(rules) & self._in_play, rules)

    def _settle(self, adoptable: Bools, rules: Sequence[Rule]) -> Bools:
        """Of several objects on one component adopt the best fitting, where a rule says so.

        Must decide as `doi._best_of_each_component` does: greedily, by IoU and then by number.
        """
        # Whether an object is adopted depends on those before it, so objects are taken in turn;
        # all rules are answered at once in each turn. Only contested objects need a turn: one that
        # shares no component with another takes nothing from anybody. An object that a rule does
        # not adopt takes nothing either, so another rule's loser may win here.
        best = np.array([rule.overlaps == "best" for rule in rules])
        adopted = adoptable.copy()
        taken = np.zeros((len(rules), len(self._parts.pair)), np.bool_)
        for place in self._holds.contested(self._objects.iou):
            held = self._holds.of_object(place)
            free = ~taken[:, held].any(axis=1) | ~best
            adopted[:, place] &= free
            taken[:, held] |= adopted[:, place, None]
        return adopted

    def _counts(self, adopted: Bools, kept: Bools) -> tuple[Ints, Ints]:
        """Return TP and FP by split of the masks of these objects and components."""
        tp, fp = self._by_pair(adopted, kept)
        return self._pool(tp), self._pool(fp)

    def _by_pair(self, adopted: Bools, kept: Bools) -> tuple[Ints, Ints]:
        parts, atoms = self._parts, self._atoms
        held = atoms.any_of(adopted)
        tp, fp = (
            sum_by(kept * of_parts, parts.pair, self._pairs)
            + sum_by(held * of_atoms, atoms.pair, self._pairs)
            for of_parts, of_atoms in ((parts.tp, atoms.tp), (parts.fp, atoms.fp))
        )
        return tp, fp

    def _pool(self, values: Ints) -> Ints:
        """Sum values (rules, pairs) over splits."""
        return sum_by(values, self._pair_split, len(self.splits))
