"""Whether a simulation says more of where the joints are than their commands say."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ident.checks.remark import Grade, Remark, joined, joints, numbers
from ident.output_error.servo_model import ServoModel
from ident.report.servos.run_page import ServoTrace
from ident.signals.arrays import Array

_BAD = 0.5  # of the error that following the command at once would have, or standing still
_FAR_WORSE = 5.0  # times the error of the fit; new motions of right recordings reach 3
_COUNTS = 3  # errors of so many steps of the encoder are none


def following(traces: Sequence[ServoTrace]) -> Array:
    """Rms distance of positions from commands [rad], shape (n,)."""
    away = np.concatenate([t.commanded - t.measured for t in traces])
    return np.sqrt(np.mean(away**2, axis=0))


def hardly_better(
    rms: Array, traces: Sequence[ServoTrace], resolution: Array, moving: NDArray[np.bool_]
) -> NDArray[np.intp]:
    """Joints whose simulation is hardly better than following the command, or standing still.

    Args:
        rms: error of the simulation [rad], shape (n,).
        traces: the recordings.
        resolution: smallest step of the positions [rad], shape (n,).
        moving: the joints that are judged, shape (n,).
    """
    still = np.concatenate([t.measured for t in traces]).std(axis=0)
    limit = np.maximum(_BAD * np.minimum(following(traces), still), _COUNTS * resolution)
    return np.flatnonzero((rms > limit) & moving)


def far_worse(log: str, rms: Array, model: ServoModel, judged: NDArray[np.intp]) -> list[Remark]:
    """Joints that a model follows far less well than those recordings that it was fitted to.

    Args:
        log: name of the recording.
        rms: error of the simulation along it [rad], shape (n,).
        model: what was simulated.
        judged: joints, from 0.
    """
    usual = np.maximum(model.noise, model.resolution)
    places = judged[rms[judged] > _FAR_WORSE * usual[judged]]
    if not len(places):
        return []
    names = model.robot.joint_names
    listed = joined(
        [
            f"{1e3 * rms[j]:.3g} instead of {1e3 * model.noise[j]:.3g} mrad at {joints([j], names)}"
            for j in places
        ]
    )
    text = f"{log}: the model errs far more than where it was fitted ({listed})."
    advice = (
        "Check that commands, zeros, gains and load are those of the fitted recordings, or fit"
        " motions of both kinds together."
    )
    return [Remark("large_error", numbers(places), text, Grade.DOUBTFUL, advice)]


def no_better_remark(places: NDArray[np.intp], names: Sequence[str], where: str) -> Remark:
    """What is said of such joints; `where` tells on which data."""
    text = (
        f"{where} the simulation of {joints(places, names)} is hardly better than following the"
        " command without delay, or than standing still."
    )
    advice = (
        "Check for end stops, contact, and commands that do not belong to the recording or have"
        " another unit, sign, or zero than the positions."
    )
    return Remark("large_error", numbers(places), text, Grade.DOUBTFUL, advice)


def fit_remarks(
    fitted: Array, left_out: Array, traces: Sequence[ServoTrace], resolution: Array,
    moving: NDArray[np.bool_], names: Sequence[str],
) -> list[Remark]:  # fmt: skip
    """What is said of joints that the model does not follow, or only where it was fitted.

    Args:
        fitted: error along all recordings [rad], shape (n,).
        left_out: error of stretches of time that are left out [rad], shape (n,).
        traces: the recordings.
        resolution: smallest step of the positions [rad], shape (n,).
        moving: the joints that are judged, shape (n,).
        names: of the joints.
    """
    bad, unlike = (hardly_better(e, traces, resolution, moving) for e in (fitted, left_out))
    said = [no_better_remark(bad, names, "Along all recordings,")] if len(bad) else []
    if len(unlike := np.setdiff1d(unlike, bad)):
        text = (
            f"The model follows {joints(unlike, names)}, but not in stretches of time that are left"
            " out: some show what no other does, such as a limit of speed or torque."
        )
        advice = "Record more of such motion, and fit it together with these recordings."
        said.append(Remark("poor_motion", numbers(unlike), text, Grade.DOUBTFUL, advice))
    return said
