"""A URDF of another arm than the one that moved: longer links, axes turned round, upside down.

They leave a small error, as does one torque in a scale of its own, since masses and friction are
fitted: most torque is that of a joint's own motion and weight, which take any length, direction and
scale. What one joint's motion does at another tells them.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import pinocchio as pin

from ident.checks.case import Case
from ident.checks.gains import Gains, gains
from ident.checks.hypotheses import alike
from ident.checks.remark import Grade, Remark, joints, numbers
from ident.checks.settings import CheckSettings
from ident.signals.arrays import Array

_LARGER = (1.2, 1.4, 1.7, 2.0, 2.5, 3.0, 4.0, 5.0, 7.0, 10.0)
_SMALLER = (0.85, 0.7, 0.6, 0.5, 0.4, 0.33, 0.25, 0.2, 0.14, 0.1)

_FAR = (1e3, 1e2, 1e-2, 1e-3)
"""Units and gears, tried by themselves: on the way there the error hardly falls."""

_MOST = 0.5
"""Of the torque beside friction, that a URDF's links account for, if it is this arm's."""

_LARGE = 1.5
"""Factor of one joint's torque that no rotor or friction stands in for."""

Change = Callable[[Case, float], Case]


def another_arm(case: Case, bounds: CheckSettings) -> list[Remark]:
    """What is said of a URDF that is another arm's, or of one joint's torque that is."""
    if hangs := _upside_down(case):
        case = case.with_gravity(-np.asarray(case.robot.model.gravity.linear))
    return [*_out_of_scale(case, bounds), *(hangs or _turned(case, bounds))]


def _upside_down(case: Case) -> list[Remark]:
    """An arm that hangs where the URDF stands, or stands where it hangs.

    Links whose centres lie on the other side of their joints fit its torque as well: only the
    URDF's own links, which then account for less than nothing, tell. In slow motion they have the
    torque's course with a negative factor as well as with a positive one, the other way up; that
    not all torques are reversed has been asked of friction before.
    """
    gravity = np.asarray(case.robot.model.gravity.linear)
    before, after = gains(case), gains(case.with_gravity(-gravity))
    if not before.common < 0.0 < after.common or after.common_explained < _MOST:
        return []
    text = (
        "The arm appears to be mounted the other way up: with gravity reversed the URDF's links"
        f" account for {100 * after.common_explained:.2g} % of the torque beside friction, and as"
        " it is for none, since their weight pulls the wrong way."
    )
    vector = ", ".join(f"{-x:g}" if x else "0" for x in gravity)
    advice = f"Set robot.gravity_m_s2: [{vector}] in the arm's file."
    return [Remark("gravity_direction", (), text, Grade.DOUBTFUL, advice)]


def _out_of_scale(case: Case, bounds: CheckSettings) -> list[Remark]:
    """Links that are all longer or shorter than the URDF's, or one torque that is too large.

    The first is another size of one series, the second a torque constant or a gear of its own.
    """
    changes: list[tuple[int | None, Change]] = [(None, _resized)]
    changes += [(k, partial(_rescaled, k)) for k in np.flatnonzero(case.probe.moving).tolist()]
    tried = [
        (*_least(case, change, sizes), k) for k, change in changes for sizes in (_LARGER, _SMALLER)
    ]
    if case.total > bounds.scan_from:
        tried.append(_far(case))
    without, size, k = min(tried, key=lambda one: one[0].error)
    large = k is not None and max(size, 1.0 / size) >= _LARGE
    if not without.better_by(bounds.scale_ratio if large else bounds.believed_ratio, case):
        return []
    figures = f"the error then falls from {100 * case.error:.3g} to {100 * without.error:.3g} %"
    if k is None:
        text = f"The arm's links appear to be about {size:g} times as long as the URDF's"
        advice = (
            "Give the URDF of this very arm, not of another size of it; if it is, check the stamps."
        )
        code, places = "cad_disagrees", ()
    else:
        near = [(s, j) for c, s, j in tried if j is not None and alike(c, without)]
        (size, k), *others = sorted(near, key=partial(_against_urdf, gains(case)))
        text = (
            f"The torque of {joints([k], case.robot.joint_names)} appears to be about"
            f" {1 / size:.2g} times as large as the other joints' torques require"
        )
        for other, j in (one for one in others if one[1] != k):
            text += f", or else that of {joints([j], case.robot.joint_names)} {1 / other:.2g} times"
        advice = (
            "Check the torque constant and the gear ratio of this joint, or its torque sensor; if"
            " the efforts are currents, let `--set torque_unit=A` estimate the gains."
        )
        code, places = "current_not_torque", numbers([k])
    return [Remark(code, places, f"{text} ({figures}).", Grade.DOUBTFUL, advice)]


def _far(case: Case) -> tuple[Case, float, int]:
    """The one joint whose torque in another unit has the least error, and its size."""
    starts = [
        (_rescaled(k, case, size), size, k)
        for k in np.flatnonzero(case.probe.moving).tolist()
        for size in _FAR
    ]
    first, start, k = min(starts, key=lambda one: one[0].error)
    near = [_least(first, partial(_rescaled, k), sizes) for sizes in (_LARGER, _SMALLER)]
    without, size = min(near, key=lambda one: one[0].error)
    return without, start * size, k


def _against_urdf(found: Gains, one: tuple[float, int]) -> float:
    """How far a joint's torque, multiplied, is from the size that the other joints' have."""
    size, k = one
    known = np.flatnonzero(found.value > 0.0)
    if k not in known:
        return np.inf
    usual = np.median(found.value[known[known != k]]) if len(known) > 1 else 1.0
    return float(np.abs(np.log(size * found.value[k] / usual)))


def _least(case: Case, change: Change, sizes: Sequence[float]) -> tuple[Case, float]:
    """The case of least error on the way from one size to the next, as far as it falls."""
    best = (case, 1.0)
    for size in sizes:
        changed = change(case, size)
        if changed.error >= best[0].error:
            break
        best = (changed, size)
    return best


def _rescaled(k: int, case: Case, size: float) -> Case:
    """The case with one joint's torque multiplied."""
    return case.with_torque(np.where(np.arange(case.robot.dof) == k, size, 1.0))


def _resized(case: Case, size: float) -> Case:
    """The case with all distances between joints multiplied."""
    model = pin.Model(case.robot.model)
    for k in range(1, model.njoints):
        place = model.jointPlacements[k].copy()
        place.translation = size * place.translation
        model.jointPlacements[k] = place
    return replace(case, robot=replace(case.robot, model=model))


def _turned(case: Case, bounds: CheckSettings) -> list[Remark]:
    """A joint that counts the other way round in position and torque alike.

    Its power and its friction stay as they are, and the arm's mirror image often moves so: there
    only the URDF's masses tell, which account for far more once the joint is turned round.
    """
    before = gains(case)
    known = before.weight > 0
    tried = []
    for k in np.flatnonzero(case.probe.moving & known.any()).tolist():
        signs = np.where(np.arange(case.robot.dof) == k, -1.0, 1.0)
        turned = replace(case, probe=case.probe.turned(signs)).with_torque(signs)
        left = np.sqrt(_unexplained(gains(turned)) / _unexplained(before))
        tried.append((float(np.log(left[known]).mean()), k, turned, left))
    if not tried:
        return []
    mean, k, turned, left = min(tried, key=lambda one: one[0])
    least = int(np.argmin(np.where(known, left, np.inf)))
    if mean > 0.0 or left[least] > bounds.turned_ratio:
        return []
    if turned.error > bounds.sign_cost * case.error:
        return []
    names = case.robot.joint_names
    text = (
        f"The position and the torque of {joints([k], names)} both appear to count in the opposite"
        f" direction to the URDF's axis (what the URDF's links leave of the torque of"
        f" {joints([least], names)} then falls to {100 * left[least]:.2g} % of what it is)."
    )
    advice = "Reverse the axis in the URDF, or the sign of the recorded position and torque."
    return [Remark("sign", numbers([k]), text, Grade.DOUBTFUL, advice)]


def _unexplained(found: Gains) -> Array:
    """Part of each joint's torque beside friction that the URDF's links leave, shape (n,)."""
    return np.maximum(1 - found.explained, 1e-9)
