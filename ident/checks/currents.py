"""Efforts that are currents: their gains, and what is said of them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ident.checks.gains import Gains
from ident.checks.remark import Grade, Remark, joined, joints, numbers
from ident.checks.settings import CheckSettings
from ident.identification.drive_gains import DriveGains, Source, coupled_ratios
from ident.model.arm import Arm
from ident.recordings.dataset import Dataset
from ident.signals.arrays import Array
from wamctl.arm.errors import ConfigurationError

_GIVE_GAINS = "Set gains_nm_per_a, or give a URDF with the arm's true masses."
_BASIS = {
    "weight": "by the masses in the URDF",
    "links": "by the links that joints share",
    "load": "by the known load",
}


def drive_gains(
    arm: Arm,
    data: Sequence[Dataset],
    weighed: Gains,
    bounds: CheckSettings,
    basis: Source = "weight",
) -> DriveGains:
    """The gains of an arm's drives from recordings of their currents.

    Args:
        arm: robot and settings.
        data: the recordings, torque in ampere.
        weighed: currents beside the torque of the URDF's links, or of a known load.
        bounds: of the checks.
        basis: which of the two.

    Raises:
        ConfigurationError: gains that are given for another number of joints.
        DataError: recordings from which nothing can be learned.
    """
    given = arm.settings.gains_nm_per_a
    if given is not None:
        return _given(np.array(given), arm.robot.dof)
    believed = (weighed.explained > bounds.gain_explained) & (weighed.value != 0.0)
    size = weighed.weight * believed if believed.any() else _squares(data)
    reference = int(np.argmax(size))
    ratios = coupled_ratios(data, arm, reference)
    apart = np.abs(ratios.value)
    of_weight = np.full(len(size), np.inf)
    of_weight[believed] = weighed.sd[believed] / np.abs(weighed.value[believed])
    common, common_sd = 1.0, np.inf
    if believed.any():
        factors = np.abs(weighed.value[believed]) / apart[believed]
        common, common_sd = _common(factors, of_weight[believed], size[believed])
    coupled = ratios.relative_sd < bounds.gain_known
    alone = ~coupled & (of_weight < bounds.gain_known)
    value = np.where(coupled, common / apart, common)
    value[alone] = 1 / np.abs(weighed.value[alone])
    sd = np.where(coupled, np.hypot(ratios.relative_sd, common_sd), np.inf)
    sd[alone] = of_weight[alone]
    source: list[Source] = [
        "links" if c else basis if w else "none" for c, w in zip(coupled, alone, strict=True)
    ]
    source[reference] = basis if believed.any() else "none"
    return DriveGains(value, sd, common_sd, tuple(source))


def _common(factors: Array, sd: Array, weight: Array) -> tuple[float, float]:
    """Torque per ampere of the reference joint [N m/A], and its relative standard error.

    The joints that carry most count most; what they contradict each other by is the URDF's error.

    Args:
        factors: current per torque that the URDF's weight tells at each joint, beside its ratio.
        sd: their relative standard errors.
        weight: square of the URDF's torque at each.
    """
    part, logs = weight / weight.sum(), np.log(factors)
    middle = float(part @ logs)
    variance = np.sum((part * sd) ** 2) + part @ (logs - middle) ** 2
    return float(np.exp(-middle)), float(np.sqrt(variance))


def _given(value: Array, n: int) -> DriveGains:
    if len(value) != n:
        raise ConfigurationError(
            "gains_nm_per_a", [f"{len(value)} gains for {n} joints: give one for each joint"]
        )
    return DriveGains(value, np.zeros(n), 0.0, ("given",) * n)


def _squares(data: Sequence[Dataset]) -> Array:
    """Square of each joint's effort about its mean, shape (n,); zero for those that are held."""
    efforts = (np.concatenate([part.tau for _, part in d.read()]) * d.moving for d in data)
    return np.sum([np.var(effort, axis=0) for effort in efforts], axis=0)


def current_remarks(
    found: DriveGains,
    moving: NDArray[np.bool_],
    names: Sequence[str],
    bounds: CheckSettings,
) -> list[Remark]:
    """What is said of the gains; doubtful where one is not known, or the common factor is not."""
    if "given" in found.source:
        return []
    places = np.flatnonzero(moving).tolist()
    known = [k for k in places if np.isfinite(found.relative_sd[k])]
    unknown = [k for k in places if not np.isfinite(found.relative_sd[k])]
    code, remarks = "current_not_torque", []
    if not np.isfinite(found.common_sd):
        coupled = [k for k in places if found.source[k] == "links"]
        told = "all parameters are known only up to one common factor"
        if coupled:
            ratios = joined([f"{found.value[k]:.3g} at joint {k + 1}" for k in coupled])
            told = f"{told} (gains beside that of the joint with most torque: {ratios})"
        elif len(places) > 1:
            told = "those of each joint are known only up to a factor of its own"
        text = (
            "The efforts are currents [A], and the masses in the URDF do not determine the drives'"
            f" gains: {told}."
        )
        return [Remark(code, (), text, Grade.DOUBTFUL, _GIVE_GAINS)]
    if known:
        listed = [
            f"{found.value[k]:.3g} ± {found.value[k] * found.relative_sd[k]:.2g} at joint {k + 1}"
            f" ({_BASIS[found.source[k]]})"
            for k in known
        ]
        text = (
            f"The efforts are currents [A]; the estimated gains [N m/A] are {joined(listed)}."
            " Parameters in N m, kg m and kg m^2 are only as accurate as these gains; those in A"
            " do not depend on them."
        )
        sure = found.common_sd < bounds.gain_sure
        grade = Grade.TRUSTWORTHY if sure else Grade.DOUBTFUL
        remarks.append(Remark(code, (), text, grade, "" if sure else _GIVE_GAINS))
    if unknown:
        text = (
            f"These recordings do not determine the gain of {joints(unknown, names)}: friction"
            " there is known in A, and in N m only up to a factor."
        )
        advice = "Move them farther, together with the other joints, or set gains_nm_per_a."
        remarks.append(Remark(code, numbers(unknown), text, Grade.DOUBTFUL, advice))
    return remarks
