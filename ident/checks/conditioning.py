"""Whether the motion tells the base parameters apart."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ident.checks.case import Case
from ident.checks.remark import Grade, Remark, joints, numbers
from ident.checks.settings import CheckSettings
from ident.dynamics.base_parameters import base_map
from ident.dynamics.parameters import Terms
from ident.estimation.regression_data import posture
from ident.model.arm import Arm
from ident.recordings.dataset import Dataset
from ident.regression.probe import Chunk
from ident.regression.probe_fit import weights_of

_STILL = 0.05
"""Part of a joint's fastest speed below which it stands."""


def conditioning_remarks(
    arm: Arm, data: Sequence[Dataset], chunks: Sequence[Chunk], case: Case, bounds: CheckSettings
) -> list[Remark]:
    """Recordings in which parameters of links and friction cannot be told from each other."""
    condition = scaled_condition(arm, data, case)
    if condition < bounds.condition_doubtful:
        if tells_too_little(case, bounds):
            return _unseen(case, bounds)
        return _on_one_line(case, bounds)
    grade = Grade.REFUSED if condition > bounds.condition_refused else Grade.DOUBTFUL
    seconds = _moved_s(chunks, case.probe.moving)
    if seconds < bounds.short_s:
        text = (
            f"The recording holds only {seconds:.2g} s of motion, too little to tell the base"
            f" parameters apart (condition number {condition:.2g} of the normalised columns; 5 to"
            " 30 is good)."
        )
        advice = "Record for longer; `ident design` computes a suitable motion."
        return [Remark("too_short", (), text, grade, advice)]
    text = (
        f"This motion does not tell the base parameters apart (condition number {condition:.2g}"
        " of the normalised columns; 5 to 30 is good)."
    )
    advice = (
        "Move all joints at once, over wide ranges and at several speeds; `ident design` computes"
        " such a motion."
    )
    return [Remark("poor_motion", (), text, grade, advice)]


def tells_too_little(case: Case, bounds: CheckSettings) -> bool:
    """Whether a fit says far less of torque that it has not seen than of torque that it has.

    Too short a motion does that, one in which each joint moves one way, or an arm that stands for
    most of the time, whatever the condition number.
    """
    return case.error > max(bounds.error_doubtful, bounds.unseen_ratio * case.fitted)


def _unseen(case: Case, bounds: CheckSettings) -> list[Remark]:
    text = (
        "Torque that was not fitted is predicted far worse than torque that was"
        f" ({100 * case.error:.3g} and {100 * case.fitted:.2g} % are left, every joint counting"
        " alike): the motion tells the parameters too little, and another one may be predicted as"
        " badly."
    )
    advice = (
        "Move all joints to and fro, over wide ranges and for longer; `ident design` computes such"
        " a motion."
    )
    grade = Grade.REFUSED if case.total > bounds.error_refused else Grade.DOUBTFUL
    return [Remark("poor_motion", (), text, grade, advice)]


def moves_as_one(case: Case, bounds: CheckSettings) -> bool:
    """Whether all joints follow one of them: what acts at one looks like what acts at another."""
    return _beside_line(case) <= bounds.aside_of_line


def _beside_line(case: Case) -> float:
    """Share of the joints' motion, each of length one, that lies beside one line."""
    places = np.flatnonzero(case.probe.moving)
    if len(places) < 2:
        return 1.0
    q = case.probe.motion.q[:, places]
    q = (q - q.mean(axis=0)) / np.maximum(q.std(axis=0), 1e-12)
    return float(1.0 - np.linalg.eigvalsh(q.T @ q)[-1] / max(float(np.sum(q**2)), 1e-300))


def _on_one_line(case: Case, bounds: CheckSettings) -> list[Remark]:
    """That all joints move as one."""
    if not moves_as_one(case, bounds):
        return []
    places, aside = np.flatnonzero(case.probe.moving), _beside_line(case)
    listed = joints(places, case.robot.joint_names)
    text = (
        f"Of the motion of {listed}, {100 * (1.0 - aside):.3g} % lies on one line: all move as one,"
        " so that a spring, a zero, a sign or another's torque at one"
        " of them can hardly be told from something at another."
    )
    advice = "Move each joint in a rhythm of its own; `ident design` computes such a motion."
    return [Remark("poor_motion", numbers(places), text, Grade.DOUBTFUL, advice)]


def scaled_condition(arm: Arm, data: Sequence[Dataset], case: Case) -> float:
    """Ratio of the extreme singular values of the base columns at length one."""
    robot = arm.robot
    terms = Terms(True, True, False, False, arm.terms.drive_matrix, False)
    base = base_map(robot, terms, [posture(d) for d in data])
    if not base.kept:
        return np.inf
    place = {name: k + k // 10 for k, name in enumerate(robot.inertial_names)}
    friction = {"fv": 0, "fc": 1}
    columns = [
        place[p.name]
        if p.kind == "inertial"
        else int(case.columns.friction[p.index - 1, friction[p.kind]])
        for p in base.kept_parameters
    ]
    W = case.columns.W[:, :, columns] * weights_of(case.columns.tau)[:, None]
    rows = W.reshape(-1, len(columns))
    length = np.linalg.norm(rows, axis=0)
    if not np.isfinite(length).all() or (length == 0).any():
        return np.inf  # a sample beyond all measure says as little as none
    values = np.linalg.eigvalsh((rows / length).T @ (rows / length))
    return float(np.sqrt(values[-1] / max(values[0], 1e-30)))


def _moved_s(chunks: Sequence[Chunk], moving: NDArray[np.bool_]) -> float:
    """Time in which any joint moves [s]."""
    total = 0.0
    for c in chunks:
        reach = max(1, round(0.05 * c.rate_hz))
        if len(c.q) <= reach:
            continue
        step = np.abs(c.q[reach:, moving] - c.q[:-reach, moving])
        most = np.quantile(step, 0.95, axis=0)
        total += float((step > _STILL * most).any(axis=1).sum()) / c.rate_hz
    return total
