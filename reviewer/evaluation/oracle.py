"""The decisions that give the highest F: exactly, in every split, for what a scope can decide.

F = 2 TP / (TP + FP + truth) of a split's pooled pixels is a ratio, so the best decision of one
region depends on all others: adopting 50 right and 60 wrong pixels is good where F is low and bad
where it is high. Dinkelbach's method (Management Science 1967) makes it a sum: decisions that are
best at a price of `rate` for every pixel found, 2 TP - rate (TP + FP), are the best of all once
`rate` is the F that they give; a few rounds lead there. At a given rate, pairs are independent
under scope `image`; under `component` objects may share components and pixels, which is a small
integer program. No rule of the same scope can have a higher F in any split. Called by `whatif`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]

MOST_ROUNDS = 50
PARTIAL = 1e-12
"""Gains of F below this are rounding."""


@dataclass(frozen=True, slots=True)
class Links:
    """What objects touch and hold, as (object, thing) columns of equal length.

    Attributes:
        parts: objects and the components that they touch, int64 (2, n).
        atoms: objects and the atoms that they hold, int64 (2, n).
        free: bool (objects,), those about which something can be decided.
    """

    parts: Ints
    atoms: Ints
    free: Bools


def highest_f(
    choose: Callable[[Floats, Bools], tuple[Ints, Ints]], truth_px: Ints, tp: Ints, fp: Ints
) -> tuple[Ints, Ints]:
    """Return TP and FP by split of the decisions with the highest F.

    Args:
        choose: TP and FP by split of the decisions with the highest sum of 2 TP - rate (TP + FP),
            for a rate by split, and whether the split is still open: what it says of others does
            not matter.
        truth_px: changed pixels by split.
        tp, fp: of any decisions, to begin with.
    """
    rate = _f_score(tp, fp, truth_px)
    waiting = np.ones(len(rate), np.bool_)
    for _ in range(MOST_ROUNDS):
        other_tp, other_fp = choose(rate, waiting)
        other = _f_score(other_tp, other_fp, truth_px)
        # A split that does not gain has found its highest F.
        waiting &= other > rate + PARTIAL
        if not waiting.any():
            break
        tp, fp = np.where(waiting, other_tp, tp), np.where(waiting, other_fp, fp)
        rate = np.where(waiting, other, rate)
    return tp, fp


def _f_score(tp: Ints, fp: Ints, truth_px: Ints) -> Floats:
    found = tp + fp + truth_px
    return np.where(found > 0, 2 * tp / np.maximum(found, 1), 0.0)


def best_decisions(
    links: Links, part_gain: Floats, atom_gain: Floats, may_reject: bool
) -> tuple[Bools, Bools]:
    """Return which objects to adopt and which components to keep for the highest sum of gains.

    A component is kept unless an object that touches it is adopted or rejected; an atom is there
    when an object that holds it is adopted.

    Args:
        part_gain, atom_gain: of having a component or an atom, float64.
        may_reject: whether an object's components may go without the object taking their place.
    """
    # Loading the solver takes longer than most questions of an evaluation.
    from scipy.optimize import Bounds, LinearConstraint, milp
    from scipy.sparse import coo_array

    objects, parts, atoms = len(links.free), len(part_gain), len(atom_gain)
    if not links.free.any():
        return np.zeros(objects, np.bool_), np.ones(parts, np.bool_)
    # Columns: adopted objects, rejected objects, kept components, atoms.
    at_part, at_atom = 2 * objects, 2 * objects + parts
    upper = np.ones(at_atom + atoms)
    upper[:objects] = links.free
    upper[objects:at_part] = links.free if may_reject else 0
    holder, part = links.parts
    owner, atom = links.atoms
    touch, hold = np.arange(len(part)), np.arange(len(atom))
    first_any = len(part)
    first_hold = first_any + parts
    first_lack = first_hold + len(atom)
    blocks: list[tuple[Ints, Ints, float]] = [
        # A touched component is either kept, or an object there is adopted or rejected.
        (touch, holder, 1.0),
        (touch, objects + holder, 1.0),
        (touch, at_part + part, 1.0),
        (first_any + part, holder, 1.0),
        (first_any + part, objects + holder, 1.0),
        (first_any + np.arange(parts), at_part + np.arange(parts), 1.0),
        # An atom is there when an object that holds it is adopted, and only then.
        (first_hold + hold, owner, 1.0),
        (first_hold + hold, at_atom + atom, -1.0),
        (first_lack + np.arange(atoms), at_atom + np.arange(atoms), 1.0),
        (first_lack + atom, owner, -1.0),
    ]
    rows, columns = (np.concatenate([block[k] for block in blocks]) for k in (0, 1))
    values = np.concatenate([np.full(len(block[0]), block[2]) for block in blocks])
    matrix = coo_array((values, (rows, columns)), (first_lack + atoms, len(upper))).tocsr()
    least = np.full(matrix.shape[0], -np.inf)
    most = np.full(matrix.shape[0], np.inf)
    most[:first_any] = 1.0
    least[first_any:first_hold] = 1.0
    most[first_hold:] = 0.0
    found = milp(
        -np.concatenate([np.zeros(at_part), part_gain, atom_gain]),
        integrality=np.arange(len(upper)) < at_part,
        bounds=Bounds(0.0, upper),
        constraints=LinearConstraint(matrix, least, most),
        options={"mip_rel_gap": 0.0},
    )
    assert found.x is not None, f"keeping everything is always possible: {found.message}"
    adopted = found.x[:objects] > 0.5
    gone = adopted | (found.x[objects:at_part] > 0.5)
    kept = np.ones(parts, np.bool_)
    kept[part[gone[holder]]] = False
    return adopted, kept
