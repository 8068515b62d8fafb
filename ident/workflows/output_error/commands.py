"""Whether commands and positions can be what they are taken for: asked of the fitted model."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ident.checks.remark import Grade, Remark, joined, joints, numbers
from ident.output_error.changed_gains import ChangedGain
from ident.output_error.parameters import ROW
from ident.output_error.servo_model import ServoModel
from ident.report.servos.run_page import ServoTrace
from ident.signals.arrays import Array

_SAME = 1e-6  # rad between a command and a position that is its copy
_SAG = 0.25  # rad that a joint may lie from its commands throughout
_STEADY = 0.5  # of which no more may change on the way
_ZERO = 0.35  # rad that a zero may be off; right ones are fitted to mounting errors of some degrees
_SURE = 3.0  # standard errors


def command_remarks(
    traces: Sequence[ServoTrace], moving: NDArray[np.bool_], names: Sequence[str]
) -> list[Remark]:
    """Commands that are the positions themselves, or lie beside them throughout.

    Args:
        traces: the recordings; the simulation takes no part.
        moving: joints that are judged, shape (n,).
        names: of the joints.
    """
    ahead = np.concatenate([t.commanded - t.measured for t in traces])
    said = []
    copies = np.flatnonzero(moving & (np.abs(ahead).max(axis=0) < _SAME)).tolist()
    if copies:
        text = f"The commands of {joints(copies, names)} are the measured positions themselves."
        advice = "Give the column in which the commands were recorded."
        said.append(Remark("commands", numbers(copies), text, Grade.DOUBTFUL, advice))
    middle = np.median(ahead, axis=0)
    spread = np.median(np.abs(ahead - middle), axis=0)
    off = moving & (np.abs(middle) > _SAG) & (spread < _STEADY * np.abs(middle))
    beside = np.flatnonzero(off).tolist()
    if beside:
        listed = joined([f"{middle[j]:.2g} rad at {joints([j], names)}" for j in beside])
        text = (
            f"The commands lie beside the measured positions throughout ({listed}): a servo that"
            " gives so far, or a zero of its own, which the fit takes for the former."
        )
        advice = "Give commands and positions about the same zero, in the same unit and sign."
        said.append(Remark("commands", numbers(beside), text, Grade.DOUBTFUL, advice))
    return said


def gain_remarks(changed: ChangedGain | None, names: Sequence[str]) -> list[Remark]:
    """A gain that is not the same in all recordings."""
    if changed is None:
        return []
    text = (
        f"The gain of {joints([changed.joint], names)} comes out {changed.factor:.2g} times as"
        f" large in {changed.more} as in {changed.less}, which its own predicts better: these are"
        " two arms, or the servo's settings were changed between them. A fit of both is of neither."
    )
    advice = "Fit recordings of one arm with the same settings together, and the others apart."
    return [Remark("recordings_disagree", numbers([changed.joint]), text, Grade.DOUBTFUL, advice)]


def zero_remarks(model: ServoModel, moving: NDArray[np.bool_]) -> list[Remark]:
    """Zeros so far off that another sign, column or URDF is likelier."""
    zero, sd = model.settings[ROW["zero"]], model.sd[ROW["zero"]]
    far = np.flatnonzero(moving & (np.abs(zero) > np.maximum(_ZERO, _SURE * sd))).tolist()
    if not far:
        return []
    names = model.robot.joint_names
    listed = joined([f"{zero[j]:.2g} ± {sd[j]:.1g} rad at {joints([j], names)}" for j in far])
    text = f"Zero positions are found far from the URDF's ({listed})."
    advice = (
        "Check zero, sign and column of these joints, and the URDF's masses, for which a zero may"
        " stand in; give zeros that are known in the arm's file (servo: fixed)."
    )
    return [Remark("zero_pose", numbers(far), text, Grade.DOUBTFUL, advice)]


def turned_remarks(turned: Array, names: Sequence[str]) -> list[Remark]:
    """Zeros that are right angles from the URDF's.

    Args:
        turned: what to add to the joints' positions [rad], shape (n,); nothing: 0.
        names: of the joints.
    """
    said = []
    for j in np.flatnonzero(turned).tolist():
        text = (
            f"The zero of {joints([j], names)} appears to be {np.degrees(turned[j]):+.0f} degrees"
            " from the URDF's: gravity then explains far more of how far the joint lags."
        )
        advice = (
            "Check the URDF's zero pose, and how the arm is mounted; give the zero in the arm's"
            f" file (servo: fixed: zero, {turned[j]:+.4f} rad here), and repeat this command."
        )
        said.append(Remark("zero_pose", (j + 1,), text, Grade.DOUBTFUL, advice))
    return said


def order_remarks(exchanged: tuple[int, int] | None, names: Sequence[str]) -> list[Remark]:
    """Two joints, from 0, whose columns appear to be exchanged; None: none do."""
    if exchanged is None:
        return []
    text = (
        f"The columns of {joints(exchanged, names)} appear to be exchanged: with commands and"
        " positions of one taken for those of the other, the URDF's links explain the motion far"
        " better."
    )
    advice = "Check the order of the joints where the columns are named."
    return [Remark("joint_order", numbers(exchanged), text, Grade.DOUBTFUL, advice)]


def early_remarks(early_s: float) -> list[Remark]:
    """Commands that are stamped after the arm has answered them, by so much [s]."""
    if early_s == 0.0:
        return []
    text = (
        "The arm answers its commands before they are stamped: with commands that come"
        f" {early_s:.2g} s earlier, it is simulated far better."
    )
    advice = "Stamp commands when they are sent, by the clock that stamps the positions."
    return [Remark("commands", (), text, Grade.DOUBTFUL, advice)]
