"""Whether the efforts can be torques: constant ones, and ones that no motion explains."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ident.checks.case import Case
from ident.checks.remark import Grade, Remark, joined, joints, numbers
from ident.checks.settings import CheckSettings
from ident.recordings.samples import ROUNDING
from ident.regression.probe import Chunk
from ident.signals.arrays import Array

_LEVELS = 64
"""A torque of fewer different values comes in steps."""

_SEARCH = "if they are right, let `ident gap` search for a missing effect."


def constant_joints(
    chunks: Sequence[Chunk], moving: NDArray[np.bool_], bounds: CheckSettings
) -> NDArray[np.bool_]:
    """Joints that move while their effort stays the same, shape (n,)."""
    tau = np.concatenate([c.tau for c in chunks])
    spread = np.sqrt(np.mean((tau - tau.mean(axis=0)) ** 2, axis=0))
    size = np.maximum(np.abs(tau).max(axis=0), 1e-6)
    return moving & (spread < bounds.constant_share * size)


def constant_effort(
    chunks: Sequence[Chunk], moving: NDArray[np.bool_], names: Sequence[str], bounds: CheckSettings
) -> list[Remark]:
    """What is said of joints that move while their effort stays the same."""
    places = np.flatnonzero(constant_joints(chunks, moving, bounds))
    if not len(places):
        return []
    tau = np.concatenate([c.tau for c in chunks])
    k = int(places[0])
    zero = bool((np.abs(tau[:, places]).max(axis=0) < 1e-9).all())
    what = "is zero" if zero else f"stays at {tau[:, k].mean():.4g}"
    text = (
        f"The effort of {joints(places, names)} {what} while the arm moves: no torque was recorded."
    )
    advice = (
        "Choose the topic or the kind of torque that holds it (--joint-states, --torque), or leave"
        f" the joint{'s' * (len(places) > 1)} out of the arm."
    )
    return [Remark("zero_effort", numbers(places), text, Grade.REFUSED, advice)]


def frozen_effort(
    chunks: Sequence[Chunk], moving: NDArray[np.bool_], names: Sequence[str], bounds: CheckSettings
) -> list[Remark]:
    """Joints that move to and fro while their effort stays the same for part of the time.

    At the largest torque of the recording that is a limit, which `ident gap` finds.
    """
    tau = np.concatenate([c.tau for c in chunks])
    low, high = tau.min(axis=0), tau.max(axis=0)
    found: dict[tuple[float, float], list[int]] = {}
    for k in np.flatnonzero(moving & ~constant_joints(chunks, moving, bounds)).tolist():
        if steps_coarsely([tau[:, k]]):
            continue
        for c in chunks:
            start, end = _longest_run(c.tau[:, k])
            q, value = c.q[start:end, k], c.tau[start, k]
            there, back = q - np.minimum.accumulate(q), np.maximum.accumulate(q) - q
            at_end = min(value - low[k], high[k] - value) <= _same(c.tau[:, k])
            at_limit = at_end and value != 0.0
            if not at_limit and min(there.max(), back.max()) > bounds.frozen_rad:
                times = c.start_s + start / c.rate_hz, c.start_s + end / c.rate_hz
                found.setdefault(times, []).append(k)
    advice = "Record again, or leave that stretch out."
    return [
        Remark("missing_data", numbers(p), _frozen(names, p, *times), Grade.DOUBTFUL, advice)
        for times, p in found.items()
    ]


def steps_coarsely(courses: Sequence[Array]) -> bool:
    """Whether a torque comes in so coarse steps that it may stay on one."""
    return len(np.unique(np.concatenate(courses))) < _LEVELS


def _frozen(names: Sequence[str], places: list[int], start_s: float, end_s: float) -> str:
    many = len(places) > 1
    return (
        f"The effort{'s' * many} of {joints(places, names)} {'stay' if many else 'stays'} the same"
        f" from {start_s:.3g} to {end_s:.3g} s while the joint{'s move' if many else ' moves'} to"
        " and fro: no torque was recorded there."
    )


def _same(values: Array) -> float:
    """By how much equal values may differ, once they are interpolated to an even clock."""
    return ROUNDING * float(np.abs(values).max())


def _longest_run(values: Array) -> tuple[int, int]:
    """Begin and end of the longest stretch of equal values."""
    steps = np.abs(np.diff(values, prepend=np.nan, append=np.nan))
    edges = np.flatnonzero(~(steps <= _same(values)))
    k = int(np.argmax(np.diff(edges)))
    return int(edges[k]), int(edges[k + 1])


def unexplained(case: Case, bounds: CheckSettings) -> list[Remark]:
    """Torque that the arm's model does not explain on data that were not fitted.

    A joint is named only where the fit itself leaves most of its torque, too: a poor motion alone
    lets the error on other data grow beyond all bounds. The model of `ident run` has no springs,
    also where the case has.
    """
    plain = replace(case, springs=False) if case.springs else case
    shares, total, names = plain.by_joint, plain.total, case.robot.joint_names
    remarks = []
    if total > bounds.error_doubtful:
        refused = total > bounds.error_refused and not case.springs
        grade = Grade.REFUSED if refused else Grade.DOUBTFUL
        text = (
            f"A rigid arm with friction leaves {100 * total:.3g} % of the torque unexplained on"
            " held-out data"
        )
        text += f", and one with springs {100 * case.total:.3g} %." if case.springs else "."
        advice = "Check that the URDF, joints, units and torque belong to this arm"
        advice += "." if grade is Grade.REFUSED else f"; {_SEARCH}"  # which would refuse as well
        remarks.append(Remark("large_error", (), text, grade, advice))
    left = case.fitted_by_joint > bounds.poorly_predicted
    places = np.flatnonzero(left & (shares > bounds.unexplained_joint))
    if len(places):
        listed = ", ".join(f"{100 * shares[k]:.0f} %" for k in places)
        text = (
            f"The torque of {joints(places, names)} is hardly explained: {listed} of it"
            f" {'is' if len(places) == 1 else 'are'} left on held-out data."
        )
        advice = f"Check the sensor, the topic, and whether the joint moves fast enough; {_SEARCH}"
        remarks.append(Remark("large_error", numbers(places), text, Grade.DOUBTFUL, advice))
    return remarks


def explained_after_all(
    remarks: Sequence[Remark], error: float, bounds: CheckSettings
) -> tuple[Remark, ...]:
    """Remarks without the doubt of the whole arm that its fit at a chosen cut-off does not share.

    The checks look at a wider band, in which noise of the positions counts as well.

    Args:
        remarks: of the checks.
        error: of the fit at its cut-off, relative, over all joints.
        bounds: of the checks.
    """
    if error > bounds.error_doubtful:
        return tuple(remarks)
    return tuple(
        r for r in remarks if r.code != "large_error" or r.joints or r.grade is not Grade.DOUBTFUL
    )


def poorly_explained(error: float, bounds: CheckSettings) -> list[Remark]:
    """A fitted model's error on data that were not fitted, where it is large at all joints alike.

    Args:
        error: relative, over all joints.
        bounds: of the checks.
    """
    if error <= bounds.error_doubtful:
        return []
    text = f"The model leaves {100 * error:.3g} % of the torque unexplained on held-out data."
    advice = f"Check that the URDF, joints, units and torque belong to this arm; {_SEARCH}"
    return [Remark("large_error", (), text, Grade.DOUBTFUL, advice)]


def links_of_no_use(error: float) -> list[Remark]:
    """The URDF's own links, where they predict the torque worse than no model at all.

    Args:
        error: of the URDF's links without friction, relative, over all joints.
    """
    if error <= 1.0:
        return []
    text = (
        f"The URDF's links leave {100 * error:.3g} % of the torque, more than no model at all,"
        " although links that were fitted explain it."
    )
    advice = (
        "Check the URDF's masses, joint types, axes and zero positions, and which way gravity"
        " points in the arm's file: links that are fitted may hide that these are wrong."
    )
    return [Remark("cad_disagrees", (), text, Grade.DOUBTFUL, advice)]


def poorly_predicted(
    shares: Array,
    rms: Array,
    names: Sequence[str],
    units: Sequence[str],
    bounds: CheckSettings,
    data: str = "held-out data",
) -> list[Remark]:
    """Joints of whose torque a fitted model explains less than half of the mean square.

    No torque at all has an error of 100 %. A light joint gets near it where the errors of a heavier
    one go into parameters that both share, and where it hardly moves, so that its torque is small.

    Args:
        shares: relative error of each joint, shape (n,); NaN for held joints.
        rms: the same error [N m or N], shape (n,).
        names: of the joints.
        units: of their torque.
        bounds: of the checks.
        data: on which the errors are.
    """
    places = np.flatnonzero(np.nan_to_num(shares) > bounds.poorly_predicted).tolist()
    if not places:
        return []
    told = joined(
        [
            f"{100 * shares[k]:.0f} % at {joints([k], names)} ({rms[k]:.2g} {units[k]}, where the"
            f" torque itself has {rms[k] / shares[k]:.2g} {units[k]}; rms)"
            for k in places
        ]
    )
    text = (
        "The model explains less than half of the torque's mean square at some joints: its error on"
        f" {data} is {told}. No model at all has 100 %."
    )
    advice = (
        "Let `ident gap` search for what the model lacks: a light joint takes up the errors of the"
        " heavier ones. If the joint hardly moved, record it moving farther and faster. If its"
        " torque does not matter to you, the figures of the other joints still hold."
    )
    if _of_most(places, shares, rms):
        advice = (
            "Check the unit, the sign and the place of each joint's torque first: one that is wrong"
            " spoils the fit of the others, whose figures do not hold, either. Let `ident gap`"
            " search for what the model lacks if they are right."
        )
    return [Remark("large_error", numbers(places), text, Grade.DOUBTFUL, advice)]


def _of_most(places: Sequence[int], shares: Array, rms: Array) -> bool:
    """Whether these are most of the joints, or have most of the torque."""
    count = int(np.isfinite(shares).sum())
    told = shares > 0  # the others are held, or were named already
    torque = np.divide(rms, shares, out=np.zeros(len(shares)), where=told) ** 2
    most = 2 * len(places) > count or 2 * torque[list(places)].sum() > torque.sum()
    return count > 1 and bool(most)


def beyond_possible(
    error: float, least: float, turned: Callable[[], float], bounds: CheckSettings
) -> list[Remark]:
    """A torque that impossible parameters explain far better, on held-out data too.

    Least squares explains a torque as well that counts the other way round, with masses below zero.
    Where the URDF has no masses that would tell, a possible arm does.

    Args:
        error: relative error of a possible arm on held-out data.
        least: the same of ordinary least squares.
        turned: finds the same as the first of the torque turned round.
        bounds: of the checks.
    """
    if error < bounds.impossible_error or error < bounds.impossible_ratio * least:
        return []
    text = (
        f"No arm that is possible explains this torque well: it leaves {100 * error:.3g} % of"
        " held-out data, and ordinary least squares, whose masses may be negative,"
        f" {100 * least:.3g} %."
    )
    if (other := turned()) < bounds.believed_ratio * error:
        text += f" Of the torque turned round it leaves {100 * other:.3g} %."
        advice = "Turn the sign of all torques: they count the other way round."
        return [Remark("sign", (), text, Grade.DOUBTFUL, advice)]
    advice = (
        "Let `ident gap` search for what the model lacks; check the URDF's axes and which motors"
        " drive which joints, the torques' units, and whether something was subtracted from them."
    )
    return [Remark("impossible_torque", (), text, Grade.DOUBTFUL, advice)]
