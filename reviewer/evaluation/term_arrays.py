"""The terms of many pairs as arrays, all pairs after one another; what `whatif` computes with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from reviewer.evaluation.rules import Rule
from reviewer.evaluation.terms import ObjectTerms, PairTerms

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]


class EquationArrays:
    """Terms of the equation as arrays."""

    def __init__(self, found: Sequence[tuple[int, ObjectTerms | None]]) -> None:
        self.pair = np.array([k for k, _ in found], np.int64)
        self.iou = np.array([t.iou for _, t in found if t], np.float64)
        self.overlap = np.array([t.overlap_px for _, t in found if t], np.int64)

    def adoptable(self, rules: Sequence[Rule]) -> Bools:
        """Return low < DoI < high, bool (rules, terms)."""
        low, high = (np.array([getattr(r, n) for r in rules])[:, None] for n in ("low", "high"))
        new = (self.overlap >= 0) & ~self._seen(rules)
        doi = np.where(new, 1.0 - self.iou, 0.0)
        return np.asarray((doi > low) & (doi < high))

    def rejected(self, rules: Sequence[Rule]) -> Bools:
        """Return what the reference shows too, where a rule rejects that, bool (rules, terms)."""
        return np.asarray(self._seen(rules) & np.array([[r.seen == "reject"] for r in rules]))

    def _seen(self, rules: Sequence[Rule]) -> Bools:
        return np.asarray(self.overlap > np.array([[rule.max_overlap_px] for rule in rules]))


class PartArrays:
    """Components of M_o, all pairs after one another."""

    def __init__(self, terms: Sequence[PairTerms]) -> None:
        flat = [(k, tp, fp) for k, t in enumerate(terms) for tp, fp in t.components]
        self.pair, self.tp, self.fp = _columns(flat)


class AtomArrays:
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

    def links(self) -> Ints:
        """Return (object, atom) columns."""
        sizes = np.diff([*self._starts, len(self._members)])
        return np.stack([self._members, np.repeat(np.arange(len(self._starts)), sizes)])


class Touching:
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
            # Sorted by component, all holders of one lie side by side, and one reduceat answers
            # for all of them; a component that nobody touches has no start and stays False.
            parts = self._part[self._by_part]
            starts = np.flatnonzero(np.diff(parts, prepend=-1))
            columns = adopted[:, self._object[self._by_part]]
            found[:, parts[starts]] = np.logical_or.reduceat(columns, starts, axis=1)
        return found

    def links(self) -> Ints:
        """Return (object, component) columns."""
        return np.stack([self._object, self._part])


def _columns(flat: Sequence[tuple[int, int, int]]) -> tuple[Ints, Ints, Ints]:
    table = np.array(flat, np.int64).reshape(-1, 3)
    return table[:, 0], table[:, 1], table[:, 2]


def _joined(groups: Sequence[npt.NDArray[np.int64]]) -> tuple[Ints, Ints]:
    members = np.concatenate([np.zeros(0, np.int64), *groups]).astype(np.int64)
    starts = np.cumsum([0, *(len(group) for group in groups)])[:-1].astype(np.int64)
    return members, starts


def sum_by(values: Ints, group: Ints, count: int) -> Ints:
    """Sum the columns of values (rules, things) by group, int64 (rules, count)."""
    total = np.zeros((len(values), count), np.int64)
    if len(group):
        order = np.argsort(group, kind="stable")
        sorted_groups = group[order]
        # reduceat needs non-empty groups: only those that occur have a start, others stay 0.
        starts = np.flatnonzero(np.diff(sorted_groups, prepend=-1))
        total[:, sorted_groups[starts]] = np.add.reduceat(values[:, order], starts, axis=1)
    return total
