"""Scores under other DoI rules, without touching a mask: thresholds, tolerance, scope.

A hundred rules over all pairs are a few matrix operations on the integers of `terms`. Decisions are
those of `doi.integrate`, the best-object rule included; a test holds the two together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from reviewer.doi import HIGH, LOW, Overlaps, Scope
from reviewer.evaluation.terms import ObjectTerms, PairTerms

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Rule:
    """A decision rule; see `doi.integrate`."""

    low: float = LOW
    high: float = HIGH
    max_overlap_px: int = 0
    scope: Scope = "component"
    overlaps: Overlaps = "best"


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
    """The terms of many pairs as arrays; made once, asked often."""

    def __init__(self, pairs: Sequence[tuple[str, PairTerms]]) -> None:
        """Take (split, terms) of every pair."""
        self.splits = tuple(sorted({split for split, _ in pairs}))
        place = {split: k for k, split in enumerate(self.splits)}
        self._pair_split = np.array([place[split] for split, _ in pairs], np.int64)
        terms = [terms for _, terms in pairs]
        self._truth = self._pool(np.array([t.truth_px for t in terms], np.int64)[None])[0]
        self._pairs = len(pairs)
        self._parts = _Parts(terms)
        self._objects = _Terms([(k, o) for k, t in enumerate(terms) for o in t.objects])
        self._images = _Terms([(k, t.image) for k, t in enumerate(terms) if t.image])
        self._atoms = _Atoms(terms)
        has_parts = np.array([bool(t.components) for t in terms], np.bool_)
        self._in_play = has_parts[self._objects.pair]
        self._image_in_play = has_parts[self._images.pair]
        self._holds = _Incidence(terms)

    def sweep(self, rules: Sequence[Rule]) -> Sweep:
        """Return the counts of every rule."""
        return Sweep(self.splits, *self._counts(*self._decided(rules)), self._truth)

    def changed_pairs(self, first: Rule, second: Rule) -> Ints:
        """Return the places of the pairs whose masks differ between two rules, ascending."""
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
            adopted[by_object] = self.adopted([rules[k] for k in by_object])
            kept[by_object] = ~self._holds.touched(adopted[by_object], kept.shape[1])
        if by_image:
            pairs = np.zeros((len(by_image), self._pairs), np.bool_)
            some = [rules[k] for k in by_image]
            pairs[:, self._images.pair] = self._images.adoptable(some) & self._image_in_play
            adopted[by_image] = pairs[:, self._objects.pair]
            kept[by_image] = ~pairs[:, self._parts.pair]
        return adopted, kept

    def base(self) -> Sweep:
        """Return the counts of the detector alone."""
        return self._one(np.zeros((1, len(self._objects.pair)), np.bool_))

    def oracle(self) -> Sweep:
        """Return the counts when every object is adopted that leaves fewer wrong pixels.

        Object by object, the better fitting first, each on components that no other has taken: what
        perfect decisions between adopt and keep could make of these objects.
        """
        tp, fp = self._holds.sums(self._parts)
        own_tp, own_fp = self._atoms.of_objects(len(self._objects.pair))
        better = (own_tp - own_fp) > (tp - fp)
        return self._one(self._settle((better & self._in_play)[None], [Rule()]))

    def adopted(self, rules: Sequence[Rule]) -> Bools:
        """Return which objects every rule adopts, bool (rules, objects); scope `component`."""
        return self._settle(self._objects.adoptable(rules) & self._in_play, rules)

    def _one(self, adopted: Bools) -> Sweep:
        kept = ~self._holds.touched(adopted, len(self._parts.pair))
        return Sweep(self.splits, *self._counts(adopted, kept), self._truth)

    def _settle(self, adoptable: Bools, rules: Sequence[Rule]) -> Bools:
        """Of several objects on one component adopt the best fitting, where a rule says so."""
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
        parts, atoms = self._parts, self._atoms
        held = atoms.any_of(adopted)
        tp = self._pool_at(kept * parts.tp, parts.pair) + self._pool_at(held * atoms.tp, atoms.pair)
        fp = self._pool_at(kept * parts.fp, parts.pair) + self._pool_at(held * atoms.fp, atoms.pair)
        return tp, fp

    def _pool_at(self, values: Ints, pair: Ints) -> Ints:
        """Sum values (rules, things) over the splits of the things' pairs."""
        return _sum_by(values, self._pair_split[pair], len(self.splits))

    def _pool(self, values: Ints) -> Ints:
        return _sum_by(values, self._pair_split, len(self.splits))


class _Terms:
    """Terms of the equation as arrays."""

    def __init__(self, found: Sequence[tuple[int, ObjectTerms | None]]) -> None:
        self.pair = np.array([k for k, _ in found], np.int64)
        self.iou = np.array([t.iou for _, t in found if t], np.float64)
        self.overlap = np.array([t.overlap_px for _, t in found if t], np.int64)

    def adoptable(self, rules: Sequence[Rule]) -> Bools:
        """Return low < DoI < high, bool (rules, terms)."""
        low, high = (np.array([getattr(r, n) for r in rules])[:, None] for n in ("low", "high"))
        tolerated = np.array([rule.max_overlap_px for rule in rules])[:, None]
        unseen = (self.overlap >= 0) & (self.overlap <= tolerated)
        doi = np.where(unseen, 1.0 - self.iou, 0.0)
        return np.asarray((doi > low) & (doi < high))


class _Parts:
    """Components of M_o, all pairs after one another."""

    def __init__(self, terms: Sequence[PairTerms]) -> None:
        flat = [(k, tp, fp) for k, t in enumerate(terms) for tp, fp in t.components]
        self.pair, self.tp, self.fp = _columns(flat)


class _Atoms:
    """Pixels of the same membership, and the objects they belong to."""

    def __init__(self, terms: Sequence[PairTerms]) -> None:
        first = np.cumsum([0, *(len(t.objects) for t in terms)])
        flat = [(k, tp, fp) for k, t in enumerate(terms) for _, tp, fp in t.atoms]
        self.pair, self.tp, self.fp = _columns(flat)
        groups = [first[k] + np.array(m) for k, t in enumerate(terms) for m, _, _ in t.atoms]
        self._members, self._starts = _joined(groups)

    def any_of(self, adopted: Bools) -> Bools:
        """Return which atoms belong to an adopted object, bool (rules, atoms)."""
        if not len(self._starts):
            return np.zeros((len(adopted), 0), np.bool_)
        found = np.logical_or.reduceat(adopted[:, self._members], self._starts, axis=1)
        return np.asarray(found)

    def of_objects(self, count: int) -> tuple[Ints, Ints]:
        """Return TP and FP of every whole object."""
        sizes = np.diff([*self._starts, len(self._members)])
        tp, fp = (
            np.bincount(self._members, np.repeat(values, sizes), count).astype(np.int64)
            for values in (self.tp, self.fp)
        )
        return tp, fp


class _Incidence:
    """Which object touches which components."""

    def __init__(self, terms: Sequence[PairTerms]) -> None:
        first = np.cumsum([0, *(len(t.components) for t in terms)])
        objects = [(first[k], o) for k, t in enumerate(terms) for o in t.objects]
        held = [start + np.array(o.components, np.int64) for start, o in objects]
        self._held: list[Ints] = held
        self._object = np.repeat(np.arange(len(held)), [len(h) for h in held])
        self._part = np.concatenate([np.zeros(0, np.int64), *held]).astype(np.int64)
        self._by_part = np.argsort(self._part, kind="stable")

    def of_object(self, place: int) -> Ints:
        """Return the components an object touches."""
        return self._held[place]

    def contested(self, iou: Floats) -> list[int]:
        """Return the objects that share a component with another, the better fitting first."""
        holders = np.bincount(self._part, minlength=1)
        shared = {int(self._object[k]) for k in np.flatnonzero(holders[self._part] > 1)}
        return sorted(shared, key=lambda place: (-iou[place], place))

    def touched(self, adopted: Bools, count: int) -> Bools:
        """Return which components an adopted object touches, bool (rules, components)."""
        found = np.zeros((len(adopted), count), np.bool_)
        if len(self._part):
            parts = self._part[self._by_part]
            starts = np.flatnonzero(np.diff(parts, prepend=-1))
            columns = adopted[:, self._object[self._by_part]]
            found[:, parts[starts]] = np.logical_or.reduceat(columns, starts, axis=1)
        return found

    def sums(self, parts: _Parts) -> tuple[Ints, Ints]:
        """Return TP and FP of the components that every object touches."""
        count = len(self._held)
        tp, fp = (
            np.bincount(self._object, values[self._part], count).astype(np.int64)
            for values in (parts.tp, parts.fp)
        )
        return tp, fp


def _columns(flat: Sequence[tuple[int, int, int]]) -> tuple[Ints, Ints, Ints]:
    table = np.array(flat, np.int64).reshape(-1, 3)
    return table[:, 0], table[:, 1], table[:, 2]


def _joined(groups: Sequence[npt.NDArray[np.int64]]) -> tuple[Ints, Ints]:
    members = np.concatenate([np.zeros(0, np.int64), *groups]).astype(np.int64)
    starts = np.cumsum([0, *(len(group) for group in groups)])[:-1].astype(np.int64)
    return members, starts


def _sum_by(values: Ints, group: Ints, count: int) -> Ints:
    """Sum the columns of values (rules, things) by group, int64 (rules, count)."""
    total = np.zeros((len(values), count), np.int64)
    if len(group):
        order = np.argsort(group, kind="stable")
        sorted_groups = group[order]
        starts = np.flatnonzero(np.diff(sorted_groups, prepend=-1))
        total[:, sorted_groups[starts]] = np.add.reduceat(values[:, order], starts, axis=1)
    return total
