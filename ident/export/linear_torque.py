"""Torques of effects that are springs, offsets and drags: what a simulator has a place for."""

from dataclasses import dataclass

import numpy as np

from ident.signals.arrays import Array
from ident.simulation.arm import Term

_PROBES = 20
_ROUNDING = 1e-9


@dataclass(frozen=True)
class LinearTorque:
    """A torque offset + stiffness q + damping qd, which the drives must overcome.

    Attributes:
        offset: [N m], shape (n,).
        stiffness: of each joint [N m/rad], shape (n,).
        damping: [N m s/rad], shape (n, n).
    """

    offset: Array
    stiffness: Array
    damping: Array


def linear_torque(term: Term, n: int) -> LinearTorque | None:
    """A term as offset, springs and damping; None where it is anything else."""
    rest = np.zeros(n)
    offset = _resistance(term, rest, rest, rest)
    axes = np.eye(n)
    stiffness = np.array([_resistance(term, e, rest, rest) - offset for e in axes]).T
    damping = np.array([_resistance(term, rest, e, rest) - offset for e in axes]).T
    rng = np.random.default_rng(0)
    for q, qd, load in rng.uniform(-3.0, 3.0, size=(_PROBES, 3, n)):
        expected = offset + stiffness @ q + damping @ qd
        found = _resistance(term, q, qd, load)
        if not np.allclose(found, expected, rtol=_ROUNDING, atol=_ROUNDING):
            return None
    own = np.diag(np.diag(stiffness))
    plain = np.array_equal(own, stiffness) and (np.diag(stiffness) >= 0.0).all()
    passive = np.linalg.eigvalsh(damping + damping.T).min() >= -_ROUNDING
    if not (plain and passive and np.allclose(damping, damping.T)):
        return None
    return LinearTorque(offset, np.diag(stiffness).copy(), damping)


def acting(term: Term, t: float, q: Array, qd: Array, load: Array) -> tuple[Array, Array]:
    """What a term adds to the drives' resistance and to the joints' friction at one sample.

    Args:
        term: an effect's torque.
        t: time [s].
        q: [rad], shape (n,).
        qd: [rad/s], shape (n,).
        load: rigid-body torque [N m], shape (n,).

    Returns:
        Resistance, and level of Coulomb friction [N m], each of shape (n,).
    """
    resistance, level = np.zeros(len(q)), np.zeros(len(q))
    arguments = (np.ascontiguousarray(x) for x in (q, qd, load))
    settings = np.array(term.settings, dtype=float)
    term.function(t, *arguments, term.joint, settings, resistance, level)
    return resistance, level


def _resistance(term: Term, q: Array, qd: Array, load: Array) -> Array:
    """Torque of a term at one sample; not-a-number where it hangs on friction's level or time."""
    first, level = acting(term, 0.0, q, qd, load)
    later, later_level = acting(term, 7.0, q, qd, load)
    changes = level.any() or later_level.any() or (first != later)
    return np.where(changes, np.nan, first)
