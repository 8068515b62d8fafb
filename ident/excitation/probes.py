"""Short motions that search a joint's range of speeds, accelerations, positions and loads.

Each has a period of twelve seconds, so that its first run at a quarter of its speed is short, too.
"""

from collections.abc import Callable

import numpy as np

from ident.excitation.effect_motions import Frame, Sketch, load_changes

PERIOD_S = 12.0

_OMEGA = 2 * np.pi / PERIOD_S
_HARMONICS = 5
_DRIFT = 0.12  # of its fastest speed, of a joint that another one's probe carries along


def slow(frame: Frame) -> Sketch:
    """One joint turns back again and again, at up to a quarter of its speed, and nearly dwells."""
    return _alone(frame, {2: 0.12, 3: 0.12})


def brisk(frame: Frame) -> Sketch:
    """One joint goes to and fro at all its speeds, both ways."""
    return _alone(frame, {1: 0.3, 2: 0.4, 3: 0.3})


def shaken(frame: Frame) -> Sketch:
    """One joint turns back as hard as its acceleration allows."""
    strength = frame.bounds.kinematic[2, frame.joint] / frame.bounds.kinematic[1, frame.joint]
    return _alone(frame, {k: strength / (3 * k * _OMEGA) for k in (3, 5, 8)})


def swept(frame: Frame) -> Sketch:
    """One joint goes through its whole range and back."""
    reach = frame.bounds.kinematic[0, frame.joint] * _OMEGA
    return _alone(frame, {1: reach / frame.bounds.kinematic[1, frame.joint]})


def loaded(frame: Frame) -> Sketch:
    """One joint keeps turning back while the others carry it through light and heavy poses."""
    return load_changes(frame, PERIOD_S, (3, 4), 1)


def paired(frame: Frame) -> Sketch:
    """A joint and the one that shares its motors move at once; now one is faster, now the other."""
    sketch = _alone(frame, {3: 0.5, 4: 0.25})
    speed = frame.bounds.kinematic[1, frame.partner]
    sketch.coefficients[[_HARMONICS + 2, _HARMONICS + 1], frame.partner] = speed / 2, -speed / 4
    return sketch


def scattered(frame: Frame, seed: int) -> Sketch:
    """All joints move, each as fast as its limits allow, along random curves."""
    rng = np.random.default_rng(seed)
    coefficients = np.zeros((2 * _HARMONICS + 1, len(frame.pose)))
    coefficients[:-1] = rng.normal(size=(2 * _HARMONICS, len(frame.pose)))
    coefficients[-1] = frame.bounds.middle
    return Sketch(PERIOD_S, coefficients, 1)


def _alone(frame: Frame, shares: dict[int, float]) -> Sketch:
    """One joint moves, `shares` of its fastest speed by harmonic; the others drift.

    A joint that ought to rest is pushed about and sticks, which looks like contacts.
    """
    harmonics = max(_HARMONICS, *shares)
    coefficients = np.zeros((2 * harmonics + 1, len(frame.pose)))
    coefficients[-1] = frame.pose
    drift = _DRIFT * frame.bounds.kinematic[1]
    for k in range(len(frame.pose)):
        coefficients[k % 2, k] = drift[k] / 2
        coefficients[harmonics + (k + 1) % 3, k] = drift[k]
    coefficients[:-1, frame.joint] = 0.0
    for harmonic, share in shares.items():
        coefficients[harmonic - 1, frame.joint] = share * frame.bounds.kinematic[1, frame.joint]
    return Sketch(PERIOD_S, coefficients, 1)


PROBES: dict[str, Callable[[Frame], Sketch]] = {
    f.__name__: f for f in (slow, brisk, shaken, swept, loaded, paired)
}
"""The probes of one joint, by name."""
