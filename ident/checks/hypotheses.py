"""Faults that leave the numbers plausible: swapped columns, signs, zero poses, mounting.

Each is tried on the probe: columns are exchanged, a joint is turned round, its zero is moved by
right angles, gravity points elsewhere, the base is not level. One that lowers the error on held-out
data far more than any wrong one does on right recordings is told.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from ident.checks.case import Case
from ident.checks.gains import gains
from ident.checks.remark import Grade, Remark, joints, numbers
from ident.checks.settings import CheckSettings
from ident.signals.arrays import Array

_MOST_ROUNDS = 3
_ALIKE = 1.05
"""Errors within this factor are alike."""

_AXES = ("x", "y", "z")

_TILTED = 0.05
"""Of a base, from which it is told [rad]."""

_FIRST_TILT, _TILTS, _NEAR = 0.2, 40, 5e-3
"""Where the search for a tilt begins [rad], its evaluations, and how near it has to come [rad]."""


@dataclass(frozen=True)
class Hypothesis:
    """A fault that the recordings may have.

    Attributes:
        code: of the remark.
        joints: that it concerns, from 0.
        text: what was found, without a full stop.
        advice: what to do about it.
        without: the recordings without that fault.
        grade: of the remark.
        torque_signs: factors that mend the torque, shape (n,), where that is all there is to it.
        columns: what would be in another joint's place.
        fitted: whether it has numbers that were chosen for the least error.
    """

    code: str
    joints: tuple[int, ...]
    text: str
    advice: str
    without: Callable[[Case], Case]
    grade: Grade
    torque_signs: Array | None = None
    columns: str = ""
    fitted: bool = False

    def remark(self, before: float, after: float) -> Remark:
        """The remark, with what the error falls from and to."""
        return self.told(f"the error then falls from {100 * before:.3g} to {100 * after:.3g} %")

    def rivals(self, other: "Hypothesis") -> bool:
        """Whether it exchanges other columns of the same joints."""
        same = self.code == other.code == "joint_order" and self.joints == other.joints
        return same and self.columns != other.columns

    def told(self, figures: str) -> Remark:
        """The remark with its evidence."""
        finding = f"{self.text} ({figures})."
        return Remark(self.code, numbers(self.joints), finding, self.grade, self.advice)


def scanned(case: Case, bounds: CheckSettings) -> tuple[Case, list[Hypothesis], list[Remark]]:
    """The faults that lower the error most, one after the other, and the case without them."""
    found, remarks = [], []
    for _ in range(_MOST_ROUNDS):
        tried = list(_hypotheses(case))
        best, without = nearest(case, tried)
        if not _believed(best, case, without, bounds):
            break
        if _weighed(case, bounds).error < without.error:
            break  # a factor at each joint, which its size tells
        rivals = [h.columns for h in tried if h.rivals(best) and alike(h.without(case), without)]
        text = ", or else their ".join([best.text, *dict.fromkeys(rivals)])
        remarks.append(replace(best, text=text).remark(case.error, without.error))
        found.append(best)
        case = without
    return case, found, remarks


def _believed(found: Hypothesis, case: Case, without: Case, bounds: CheckSettings) -> bool:
    """Whether so much more is explained without the fault as no wrong one would.

    At all joints, or, where columns are exchanged, at each joint in question: what others leave for
    another reason says nothing of it.
    """
    if found.code == "joint_order" and without.error < case.error:
        own = list(found.joints)
        held_out = without.by_joint[own] / case.by_joint[own]
        fitted = without.fitted_by_joint[own] / case.fitted_by_joint[own]
        if max(held_out.max(), fitted.max()) <= bounds.believed_ratio:
            return True
    return without.better_by(bounds.believed_ratio, case) and _borne_out(found, case, without)


def _borne_out(found: Hypothesis, case: Case, without: Case) -> bool:
    """Whether joints that would be in another's place are themselves explained better without it.

    Each of a pair, since no wrong torque fits better than the right one. Where they are explained
    well as they are, it is another joint's few data that fit by chance.
    """
    if found.code != "joint_order":
        return True
    own = list(found.joints)
    before, after = case.by_joint[own], without.by_joint[own]
    return bool((after < before).all() if len(own) == 2 else after.mean() < before.mean())


def _weighed(case: Case, bounds: CheckSettings) -> Case:
    """The case with each joint's torque as large as the URDF's links require, where they tell."""
    found = gains(case)
    sure = (found.explained > bounds.gain_explained) & (found.value != 0.0)
    size = np.abs(found.value[sure])
    usual = float(np.median(size)) if sure.any() else 1.0
    factors = np.full(case.robot.dof, 1.0 / usual)
    factors[sure] = 1.0 / size
    return case.with_torque(factors)


def least_error(case: Case) -> float:
    """The least error that the case has without one of the faults."""
    return min(h.without(case).error for h in _hypotheses(case))


def _preference(pair: tuple[Hypothesis, Case]) -> float:
    """The error; of two that fit alike, a torque's sign comes first, what was fitted last."""
    hypothesis, without = pair
    rank = 0 if hypothesis.torque_signs is not None else 2 if hypothesis.fitted else 1
    return without.error * _ALIKE**rank


def alike(one: Case, other: Case) -> bool:
    """Whether two cases have about the same error."""
    return max(one.error, other.error) < _ALIKE * min(one.error, other.error)


def nearest(case: Case, hypotheses: Sequence[Hypothesis]) -> tuple[Hypothesis, Case]:
    """The one of some faults without which the error is least, and the case without it."""
    return min(((h, h.without(case)) for h in hypotheses), key=_preference)


def _hypotheses(case: Case) -> Iterator[Hypothesis]:
    moving = np.flatnonzero(case.probe.moving).tolist()
    yield from _orders(case, moving)
    for k in moving:
        yield torque_sign(case, k)
        yield position_sign(case, k)
        yield from _zeros(case, k)
    yield from _gravities(case)
    yield from _tilt(case)


def by_weight(case: Case, bounds: CheckSettings) -> tuple[Case, list[Remark]]:
    """A zero pose or mounting under which the URDF's own links fit, where they do not as it is.

    A wrong zero may leave the error as it is, since other parameters take its place.
    """
    before = gains(case)
    if not before.value.any() or before.common_explained > bounds.cad_looks:
        return case, []
    moving = np.flatnonzero(case.probe.moving).tolist()
    tried = [h for k in moving for h in _zeros(case, k)] + list(_gravities(case))
    found = [(gains(h.without(case)), h) for h in tried]
    fitting = [(g.common_explained, i) for i, (g, _) in enumerate(found) if 1 / 3 < g.common < 3]
    best, place = max(fitting, default=(0.0, 0))
    without = found[place][1].without(case) if fitting else case
    if best < bounds.cad_fits or without.error > bounds.sign_cost * case.error:
        return case, []
    figures = (
        f"the URDF's links then account for {100 * best:.0f} % of the torque beyond friction,"
        f" instead of {100 * max(before.common_explained, 0.0):.0f} %"
    )
    return without, [found[place][1].told(figures)]


def torque_sign(case: Case, k: int) -> Hypothesis:
    """The torque of a joint counts the other way round."""
    names, signs = case.robot.joint_names, _signs(case, k)
    text = f"The torque of {joints([k], names)} has the wrong sign and was inverted"
    return Hypothesis(
        "sign",
        (k,),
        text,
        "Correct the sign where the torque is recorded.",
        lambda c: c.with_torque(signs),
        Grade.DOUBTFUL,
        torque_signs=signs,
    )


def position_sign(case: Case, k: int) -> Hypothesis:
    """The position of a joint counts the other way round."""
    names, signs = case.robot.joint_names, _signs(case, k)
    return Hypothesis(
        "sign",
        (k,),
        f"The position of {joints([k], names)} counts in the opposite direction to the URDF's axis",
        "Reverse the axis in the URDF, or the sign of the recorded position.",
        lambda c: replace(c, probe=c.probe.turned(signs)),
        Grade.REFUSED,
    )


def _signs(case: Case, k: int) -> Array:
    signs = np.ones(case.robot.dof)
    signs[k] = -1.0
    return signs


def _orders(case: Case, moving: list[int]) -> Iterator[Hypothesis]:
    n, names = case.robot.dof, case.robot.joint_names
    for pair in combinations(moving, 2):
        order = np.arange(n)
        order[list(pair)] = pair[::-1]
        yield from _exchanges(pair, order, joints(pair, names), "swapped")
    if len(moving) > 2:
        whole = np.arange(n)
        whole[moving] = moving[::-1]
        yield from _exchanges(tuple(moving), whole, "all joints", "in reverse order")
        for places in (1, -1):
            shifted = np.arange(n)
            shifted[moving] = np.roll(moving, places)
            yield from _exchanges(tuple(moving), shifted, "all joints", "shifted by one joint")
        by_name = np.arange(n)
        by_name[moving] = np.argsort(np.argsort([names[k] for k in moving])) + moving[0]
        if sorted(by_name) == list(range(n)) and (by_name != np.arange(n)).any():
            yield from _exchanges(tuple(moving), by_name, "all joints", "sorted by name")


def _exchanges(
    places: tuple[int, ...], order: NDArray[np.intp], whose: str, how: str
) -> Iterator[Hypothesis]:
    def torque(case: Case) -> Case:
        return case.with_torque(order=order)

    def position(case: Case) -> Case:
        return replace(case, probe=case.probe.positions_of(order.tolist()))

    def both(case: Case) -> Case:
        return position(case).with_torque(order=order)

    changes = (("torques", torque), ("positions", position), ("positions and torques", both))
    for what, change in changes:
        text = f"The {what} of {whose} appear to be {how}"
        advice = "Correct the order of the joints in the recording."
        yield Hypothesis("joint_order", places, text, advice, change, Grade.REFUSED, columns=what)


def _zeros(case: Case, k: int) -> Iterator[Hypothesis]:
    if case.robot.sliding[k]:
        return
    for turns in (1, 2, 3):
        offset = np.zeros(case.robot.dof)
        offset[k] = turns * np.pi / 2
        degrees = 90 * turns if turns < 3 else -90
        text = (
            f"The zero position of {joints([k], case.robot.joint_names)} appears to be wrong: the"
            f" URDF fits the torque if {degrees} degrees are added to the recorded positions"
        )
        advice = "Correct the zero position in the URDF or in the recording."
        yield Hypothesis("zero_pose", (k,), text, advice, _shift(offset), Grade.DOUBTFUL)


def _shift(offset: Array) -> Callable[[Case], Case]:
    return lambda case: replace(case, probe=case.probe.shifted(offset))


def _gravities(case: Case) -> Iterator[Hypothesis]:
    present = np.asarray(case.robot.model.gravity.linear)
    size = float(np.linalg.norm(present))
    if size == 0.0:
        size = 9.81
    else:
        text = "The torque appears to hold no gravity, as that of a controller that compensates it"
        advice = (
            "Record the whole torque, gravity included, or set robot.gravity_m_s2: [0, 0, 0] in the"
            " arm's file to fit inertia and friction alone."
        )
        none = _fall(np.zeros(3))
        yield Hypothesis("gravity_direction", (), text, advice, none, Grade.DOUBTFUL)
    for axis in range(3):
        for sign in (1.0, -1.0):
            wanted = np.zeros(3)
            wanted[axis] = sign * size
            if np.allclose(wanted, present, atol=0.1 * size):
                continue
            where = f"{'+' if sign > 0 else '-'}{_AXES[axis]}"
            vector = ", ".join(f"{x:g}" for x in wanted)
            text = f"The arm appears to be mounted so that gravity points along {where} of its base"
            advice = f"Set robot.gravity_m_s2: [{vector}] in the arm's file."
            yield Hypothesis("gravity_direction", (), text, advice, _fall(wanted), Grade.DOUBTFUL)


def _tilt(case: Case) -> Iterator[Hypothesis]:
    """A base that is not level: the direction of gravity with which the error is least."""
    gravity = np.asarray(case.robot.model.gravity.linear)
    size = float(np.linalg.norm(gravity))
    if size == 0.0:
        return
    across = np.linalg.svd(gravity[None] / size)[2][1:]

    def turned(tilt: Array) -> Array:
        return Rotation.from_rotvec(tilt @ across).apply(gravity)

    first = _FIRST_TILT * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    limits = {"initial_simplex": first, "maxfev": _TILTS, "xatol": _NEAR, "fatol": 1e-4}
    found = minimize(
        lambda tilt: case.with_gravity(turned(tilt)).error,
        first[0],
        method="Nelder-Mead",
        options=limits,
    )
    if (angle := float(np.linalg.norm(found.x))) < _TILTED:
        return
    vector = ", ".join(f"{x:.2f}" for x in turned(found.x))
    text = f"The base appears to be tilted by {np.degrees(angle):.0f} degrees from the URDF's"
    advice = f"Set robot.gravity_m_s2: [{vector}] in the arm's file, or level the base."
    without = _fall(turned(found.x))
    yield Hypothesis("gravity_direction", (), text, advice, without, Grade.DOUBTFUL, fitted=True)


def _fall(gravity: Array) -> Callable[[Case], Case]:
    return lambda case: case.with_gravity(gravity)
