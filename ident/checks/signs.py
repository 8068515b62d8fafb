"""Torque of the wrong sign: friction would feed the motion instead of braking it.

Least squares alone hardly tells a joint's sign, since the links' parameters follow it; friction and
the arm's own weight, do. Recordings of one arm share its signs unless that costs error.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.checks.case import Case
from ident.checks.gains import gains
from ident.checks.hypotheses import alike, nearest, position_sign, torque_sign
from ident.checks.remark import Grade, Remark, joints, numbers
from ident.checks.settings import CheckSettings
from ident.regression.probe_fit import bounded_residual, gram, shares, solution, weights_of
from ident.signals.arrays import Array

DRIVING_FRICTION = "driving_friction"
"""Code of the remark that no physically possible arm explains the torque."""

_STRETCHES = 12
_COULOMB = 1
"""Place of Coulomb friction among a joint's columns of friction; viscous friction is the first."""

_CLEAR_GAIN = 0.7
_SURE = 5.0
_FAST = 0.95
"""Quantile of the speed at which friction is looked at."""

_CHANGES = 0.95
"""Of the error, above which it hardly changes."""

_RISES = 1.02
"""Of the error: more is no chance of held-out data, and the torque was the right way round."""

_ADVICE = "Correct the sign where the torque is recorded."


@dataclass(frozen=True)
class Signed:
    """A recording without wrong signs.

    Attributes:
        case: the recording, mended.
        factors: by which its torque was multiplied, shape (n,).
        remarks: what was found.
    """

    case: Case
    factors: Array
    remarks: Sequence[Remark]


@dataclass(frozen=True)
class FrictionPower:
    """Power that friction takes, beside rms torque times rms speed.

    Attributes:
        value: of each joint, shape (n,); friction that brakes is positive.
        sd: its standard error, by leaving out stretches, shape (n,).
        coulomb, coulomb_sd: of its part that does not grow with speed, shape (n,).
    """

    value: Array
    sd: Array
    coulomb: Array
    coulomb_sd: Array

    def negative(self, least: float, deviations: float) -> NDArray[np.bool_]:
        """Joints whose friction feeds the motion, shape (n,).

        None whose Coulomb friction brakes it: a torque that is reversed reverses that as well,
        while a drive that makes up for viscous friction leaves it.
        """
        brakes = (self.coulomb > least) & (self.coulomb > deviations * self.coulomb_sd)
        return (self.value < -least) & (self.value < -deviations * self.sd) & ~brakes

    def positive(self, least: float, deviations: float) -> NDArray[np.bool_]:
        """Joints whose friction brakes it, shape (n,)."""
        return (self.value > least) & (self.value > deviations * self.sd)


def friction_power(case: Case) -> FrictionPower:
    """The power of friction in the least squares of all samples."""
    c, probe = case.columns, case.probe
    w = weights_of(c.tau)
    stretch = probe.log * _STRETCHES + np.arange(len(probe.t)) * _STRETCHES // len(probe.t)
    parts = [np.flatnonzero(stretch == s) for s in np.unique(stretch)]
    grams = [gram(c.W[p] * w[:, None], c.tau[p] * w) for p in parts]
    A, y = np.sum([g[0] for g in grams], axis=0), np.sum([g[1] for g in grams], axis=0)
    size = np.sqrt(np.mean(c.tau**2, axis=0) * np.mean(probe.motion.qd**2, axis=0))

    def power(beta: Array) -> Array:
        joint = np.arange(len(w))[:, None]
        own = c.W[:, joint, c.friction]
        parts = np.einsum("sjk,jk,sj->kj", own, beta[c.friction], probe.motion.qd) / len(own)
        parts = np.divide(parts, size, out=np.zeros_like(parts), where=size > 0)
        return np.array([parts.sum(axis=0), parts[_COULOMB]])

    without = np.array([power(solution(A - a, y - b)) for a, b in grams])
    count = len(grams)
    spread = (count - 1) / count * np.sum((without - without.mean(axis=0)) ** 2, axis=0)
    (value, coulomb), (sd, coulomb_sd) = power(solution(A, y)), np.sqrt(spread)
    return FrictionPower(value, sd, coulomb, coulomb_sd)


def of_one_arm(together: Case, signed: Sequence[Signed], bounds: CheckSettings) -> list[Signed]:
    """The recordings with the same signs, where single ones differ and that costs no error.

    Args:
        together: all recordings as they are.
        signed: each of them, mended by itself.
        bounds: of the checks.
    """
    signs = np.array([s.factors for s in signed])
    refused = any(r.grade is Grade.REFUSED for s in signed for r in s.remarks)
    if refused or (signs == signs[0]).all():
        return list(signed)
    apart = together.with_torque(signs[together.probe.log])
    tried = [*np.unique(signs, axis=0), signs.min(axis=0)]
    alike = [(together.with_torque(one), one) for one in tried]
    fitting = [(c, one) for c, one in alike if c.error < bounds.sign_cost * apart.error]
    if not fitting:
        return list(signed)
    _, best = min(fitting, key=lambda pair: (feeding(pair[0], bounds).sum(), pair[0].error))
    return [_as_in_others(s, best) for s in signed]


def _as_in_others(own: Signed, signs: Array) -> Signed:
    """A recording with the signs of the others."""
    if (own.factors == signs).all():
        return own
    names = own.case.robot.joint_names
    rest = [r for r in own.remarks if r.code != "sign"]
    wrong, kept = np.flatnonzero(signs < 0), np.flatnonzero((own.factors < 0) & (signs > 0))
    told, alike = [], "as in the other recordings of this arm"
    if len(wrong):
        text = f"The torque of {joints(wrong, names)} was inverted, {alike}."
        told.append(Remark("sign", numbers(wrong), text, Grade.DOUBTFUL, _ADVICE))
    if len(kept):
        text = (
            f"By this recording alone the torque of {joints(kept, names)} has the wrong sign: its"
            " friction would drive the motion. By the other recordings of this arm it has the right"
            " one, so it was left as it is."
        )
        advice = "Check whether this recording's stamps and columns are those of the others."
        told.append(Remark("sign", numbers(kept), text, Grade.DOUBTFUL, advice))
    return Signed(own.case.with_torque(signs / own.factors), signs, [*rest, *told])


def said_once(remarks: Sequence[Remark], signs: Array, names: Sequence[str]) -> list[Remark]:
    """Inverted torques as they are in the end, where some were inverted twice on the way."""
    whole = next(r for r in remarks if r.code == "sign" and not r.joints)
    upright = set(numbers(np.flatnonzero(signs > 0)))
    again = [r for r in remarks if r.code == "sign" and upright >= set(r.joints)]
    rest = [r for r in remarks if r not in again]
    wrong = np.flatnonzero(signs < 0).tolist()
    text = f"The torque of {joints(wrong, names)} has the wrong sign and was inverted."
    return [Remark("sign", numbers(wrong), text, Grade.DOUBTFUL, whole.advice), *rest]


def feeding(case: Case, bounds: CheckSettings) -> NDArray[np.bool_]:
    """Joints whose friction, or else whose own weight, says that their torque is reversed."""
    power = friction_power(case)
    negative = power.negative(bounds.friction_power, bounds.friction_deviations)
    positive = power.positive(bounds.friction_power, bounds.friction_deviations)
    sizes = gains(case)
    clear = sizes.explained > bounds.gain_explained
    lifted = clear & (sizes.value < -_SURE * sizes.sd)
    upright = clear & (sizes.value > _SURE * sizes.sd)
    return negative | (lifted & ~positive & upright.any())


def all_reversed(case: Case, bounds: CheckSettings) -> tuple[Case, bool, list[Remark]]:
    """Whether all torques count the other way round, by friction or by the arm's weight."""
    power = friction_power(case)
    negative = power.negative(bounds.friction_power, bounds.friction_deviations)
    positive = power.positive(bounds.friction_power, bounds.friction_deviations)
    by_friction = 2 * negative.sum() > case.probe.moving.sum() and not positive.any()
    size = gains(case)
    lifted = size.common < 0 and size.common_explained > _CLEAR_GAIN and not positive.any()
    if not (by_friction or lifted):
        return case, False, []
    why = "friction would drive the motion" if by_friction else "the arm's weight would lift it"
    text = f"The torque of all joints has the wrong sign ({why}) and was inverted."
    advice = "Record the torque that the drives exert on the arm, not its reaction."
    remark = Remark("sign", (), text, Grade.DOUBTFUL, advice)
    return case.with_torque(-1.0), True, [remark]


def feeding_turned(
    case: Case, tells: bool, bounds: CheckSettings
) -> tuple[Case, Array, list[Remark]]:
    """What to do about joints whose friction is negative: each by itself, or else all together.

    Nothing where the fit predicts the torque no better than no model does: it then knows as little
    of the friction. Where the motion does not tell parameters apart, no position is called
    reversed, and no torque is turned whose error does not fall by it.
    """
    wrong = np.flatnonzero(feeding(case, bounds) & (case.error < 1.0))
    found, signs, remarks = case, np.ones(case.robot.dof), []
    for k in wrong.tolist():
        found, change, remark = _turned(found, k, tells, bounds)
        signs = signs * change
        remarks.append(remark)
    if len(wrong) > 1 and feeding(found, bounds)[wrong].any():
        all_ = np.ones(case.robot.dof)
        all_[wrong] = -1.0
        without = case.with_torque(all_)
        falls = without.error < _CHANGES * case.error
        if (tells or falls) and _brakes(case, without, wrong, bounds):
            names = case.robot.joint_names
            text = f"The torque of {joints(wrong, names)} has the wrong sign and was inverted"
            text = f"{text} ({_figures(case, without)})."
            remark = Remark("sign", numbers(wrong), text, Grade.DOUBTFUL, _ADVICE)
            return without, all_, [remark]
    return found, signs, remarks


def _brakes(
    case: Case, without: Case, places: NDArray[np.intp] | int, bounds: CheckSettings
) -> bool:
    """Whether friction brakes these joints once they are turned, and the error does not rise."""
    rises = without.error > _RISES * case.error
    return not rises and not bool(np.any(feeding(without, bounds)[places]))


def _turned(
    case: Case, k: int, tells: bool, bounds: CheckSettings
) -> tuple[Case, Array | float, Remark]:
    """What to do about a joint whose friction is negative."""
    names = case.robot.joint_names
    faults = [torque_sign(case, k), *([position_sign(case, k)] if tells else [])]
    best, without = nearest(case, faults)
    falls = without.error < _CHANGES * case.error
    if (tells or falls) and _brakes(case, without, k, bounds):
        change = 1.0 if best.torque_signs is None else best.torque_signs
        rival = [f.without(case) for f in faults if f.torque_signs is None and f is not best]
        if any(alike(r, without) and _brakes(case, r, k, bounds) for r in rival):
            whose = joints([k], names)
            text = f"The torque of {whose}, or else its position, has the wrong sign; the torque"
            best = replace(best, text=f"{text} was inverted")
        return without, change, best.told(_figures(case, without))
    reason, advice = "has the wrong sign", "Check the stamps and the sign of this joint's torque."
    if without.error > _RISES * case.error:
        reason = "another joint's is wrong; turned round, it is explained worse"
        advice = "Check the stamps, and the unit of every joint's torque."
    text = (
        f"Friction at {joints([k], names)} would drive the motion: the torque lags or leads the"
        f" position, or {reason}."
    )
    return case, 1.0, Remark("sign", numbers([k]), text, Grade.DOUBTFUL, advice)


def _figures(case: Case, without: Case) -> str:
    before, after = (f"{100 * c.error:.3g} %" for c in (case, without))
    change = f"falls from {before} to {after}"
    if without.error > _CHANGES * case.error:
        change = f"hardly changes: {before} before, {after} after"
    return f"its friction, or its weight, would drive the motion otherwise; the error {change}"


def driving_friction(case: Case, bounds: CheckSettings) -> list[Remark]:
    """Joints whose torque no friction explains that always brakes.

    Their line of friction over speed drives the motion somewhere in its range, and the torque is
    explained far worse without that. Motors that joints share are not judged.
    """
    c, n = case.columns, case.robot.dof
    w = weights_of(c.tau)
    viscous, coulomb = solution(*gram(c.W * w[:, None], c.tau * w))[c.friction].T
    speed = np.quantile(np.abs(case.probe.motion.qd), _FAST, axis=0)
    least = w * np.minimum(coulomb, coulomb + viscous * speed)
    shared = np.zeros(n, dtype=bool)
    if case.terms.motor_friction:
        rows = case.terms.drive_matrix[[m - 1 for m in case.terms.coupled_motors]]
        shared = (rows != 0.0).any(axis=0)
    drives = case.probe.moving & ~shared & (least < -bounds.driving_friction)
    if not drives.any():
        return []
    braking = shares(bounded_residual(c, c.friction[~shared].ravel()), c.tau)
    worse = braking > np.maximum(bounds.driving_ratio * case.by_joint, bounds.driving_error)
    places = np.flatnonzero(drives & worse)
    if not len(places):
        return []
    errors = ", ".join(
        f"{100 * b:.0f} instead of {100 * f:.0f} %"
        for b, f in zip(braking[places], case.by_joint[places], strict=True)
    )
    text = (
        f"Friction at {joints(places, case.robot.joint_names)} would have to drive the motion at"
        f" some speeds; with friction that always brakes, {errors} of the torque is left."
    )
    advice = (
        "Check whether the drive adds or takes off a part of the torque that was recorded, such as"
        " a compensation of friction, and the signs of these joints."
    )
    return [Remark(DRIVING_FRICTION, numbers(places), text, Grade.DOUBTFUL, advice)]
