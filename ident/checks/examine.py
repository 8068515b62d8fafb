"""All checks of some recordings in order: description, samples, motion, torque, physics."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ident.checks.case import Case
from ident.checks.conditioning import (
    conditioning_remarks,
    moves_as_one,
    scaled_condition,
    tells_too_little,
)
from ident.checks.currents import current_remarks, drive_gains
from ident.checks.gains import gains
from ident.checks.hypotheses import by_weight, least_error, scanned
from ident.checks.known_load import KnownLoad, gains_of_load
from ident.checks.motion import (
    degrees_remark,
    in_degrees,
    jump_remarks,
    limit_remarks,
    little_motion,
    rate_remarks,
)
from ident.checks.recorder_faults.delay import lag
from ident.checks.recorder_faults.glitches import glitch_remarks
from ident.checks.recorder_faults.held_torque import held_torque
from ident.checks.recorder_faults.lasting_jumps import lasting_jumps
from ident.checks.recorder_faults.positions import position_remarks
from ident.checks.recorder_faults.torque_range import clipped_torque, shifted_torque_zero
from ident.checks.recorder_faults.velocities import stuck_remarks, velocity_remarks
from ident.checks.remark import Grade, Remark, verdict_of
from ident.checks.samples import log_remarks, name_remarks, reference_remarks, sample_remarks
from ident.checks.settings import DEFAULT, CheckSettings
from ident.checks.signs import (
    Signed,
    all_reversed,
    driving_friction,
    feeding_turned,
    of_one_arm,
    said_once,
)
from ident.checks.surroundings.base_motion import base_remarks
from ident.checks.surroundings.load_changes import load_change_remarks
from ident.checks.torque import constant_effort, constant_joints, frozen_effort, unexplained
from ident.checks.units import unit_factor, unit_remarks
from ident.checks.urdf_faults.another_arm import another_arm
from ident.checks.urdf_faults.description import description_remarks
from ident.identification.drive_gains import DriveGains
from ident.model.arm import Arm
from ident.recordings.dataset import Dataset, Parts
from ident.regression.probe import Chunk, Probe, chunks_of, probe_of
from ident.signals.arrays import Array

OF_FITS = ("too_short", "poor_motion")
"""Codes that matter only where something is fitted to the recordings."""

OF_LOADS = ("cad_disagrees", "current_not_torque", "units")
"""Codes of what a load that the URDF lacks may look like."""

_INSTANTS = 500
_CUTOFFS_HZ = (1.0, 10.0)
_OVER_MOTION = 5.0
"""The probe's cut-off lies so far above what holds nine tenths of the velocity's energy."""

_ENERGY = 0.9


@dataclass(frozen=True)
class Examined:
    """Recordings after the checks.

    Attributes:
        data: the recordings, with what could be mended mended.
        remarks: what the checks found.
        gains: of the drives, where efforts were currents; the data hold torque then.
    """

    data: tuple[Dataset, ...]
    remarks: tuple[Remark, ...]
    gains: DriveGains | None = None

    @property
    def verdict(self) -> Grade:
        """The worst grade."""
        return verdict_of(self.remarks)


def examine(
    arm: Arm,
    data: Sequence[Dataset],
    bounds: CheckSettings = DEFAULT,
    load: KnownLoad | None = None,
) -> Examined:
    """Check recordings of an arm before anything is fitted to them.

    Args:
        arm: robot and settings.
        data: the recordings, joints in the robot's order.
        bounds: of the checks.
        load: a recording with a known load, which tells the gains of drives whose currents were
            recorded.
    """
    remarks = description_remarks(arm.robot) + log_remarks(data)
    found, gains = tuple(data), None
    for stage in (_samples, _signals):
        if verdict_of(remarks) is not Grade.REFUSED:
            found, more = stage(arm, found, bounds)
            remarks += more
    if verdict_of(remarks) is not Grade.REFUSED:
        if arm.settings.torque_unit == "A":
            found, gains, more = _currents(arm, found, bounds, load)
            remarks += more
        found, more = _physics(arm, found, bounds)
        remarks += more
    return Examined(found, tuple(remarks), gains)


Stage = tuple[tuple[Dataset, ...], list[Remark]]


def _samples(arm: Arm, data: tuple[Dataset, ...], bounds: CheckSettings) -> Stage:
    """What can be told from stamps, samples, and ranges."""
    found, remarks = [], []
    for one in data:
        joints = _likelier(arm, one, in_degrees(arm.robot, one, bounds))
        if joints.any():
            one = _in_rad(one, joints & ~arm.robot.sliding)
            remarks.append(degrees_remark(one, arm.robot, joints))
        else:
            remarks += limit_remarks(arm.robot, one, bounds)
        one, more = glitch_remarks(one, arm.robot.joint_names, bounds)
        remarks += more
        remarks += name_remarks(one)
        remarks += reference_remarks(one, arm.robot.joint_names, bounds)
        remarks += velocity_remarks(one, arm.robot.joint_names, joints, bounds)
        remarks += stuck_remarks(one, arm.robot.joint_names)
        remarks += held_torque(one, arm.robot.joint_names)
        one, more = sample_remarks(one, bounds)
        found.append(one)
        remarks += more
    return tuple(found), remarks


def _likelier(arm: Arm, data: Dataset, readings: Sequence[NDArray[np.bool_]]) -> NDArray[np.bool_]:
    """The joints in degrees with which the arm's model explains most of the torque, shape (n,)."""

    def error(joints: NDArray[np.bool_]) -> float:
        one = _in_rad(data, joints & ~arm.robot.sliding)
        return Case(arm.robot, arm.terms, _probe(chunks_of([one]), one.moving[None])).error

    return readings[0] if len(readings) == 1 else min(readings, key=error)


def _in_rad(data: Dataset, joints: NDArray[np.bool_]) -> Dataset:
    """A recording of which these joints, shape (n,), are in degrees, converted."""
    factors = np.where(joints, np.pi / 180, 1.0)
    return replace(data, read=partial(_converted, data, factors), place=data.place * factors)


def _converted(data: Dataset, factors: Array) -> Parts:
    for number, part in data.read():
        wanted = None if part.reference is None else part.reference * factors
        yield number, replace(part, q=part.q * factors, reference=wanted)


def _signals(arm: Arm, data: tuple[Dataset, ...], bounds: CheckSettings) -> Stage:
    """What can be told from positions and torques as they are."""
    chunks = chunks_of(data)
    moving = _moving(data)
    names = arm.robot.joint_names
    jumps = jump_remarks(arm.robot, data, chunks, bounds) or lasting_jumps(data, chunks, names)
    remarks = [
        *constant_effort(chunks, moving, names, bounds),
        *frozen_effort(chunks, moving, names, bounds),
        *jumps,
        *([] if jumps else rate_remarks(data, chunks, bounds)),
        *little_motion(arm.robot, data, chunks, bounds),
    ]
    return data, remarks


def _moving(data: Sequence[Dataset]) -> NDArray[np.bool_]:
    return np.any([d.moving for d in data], axis=0)


def _currents(
    arm: Arm, data: tuple[Dataset, ...], bounds: CheckSettings, load: KnownLoad | None
) -> tuple[tuple[Dataset, ...], DriveGains, list[Remark]]:
    """Currents as torque, and the gains."""
    moving = _moving(data)
    shown = data if load is None else (*data, load.data)
    probe = _probe(chunks_of(shown), np.array([d.moving for d in shown]))
    case = Case(arm.robot, arm.terms, probe)
    weighed = gains(case, rotors=True) if load is None else gains_of_load(case, load.load)
    found = drive_gains(arm, data, weighed, bounds, "weight" if load is None else "load")
    torques = tuple(d.with_torque_times(found.value) for d in data)
    return torques, found, current_remarks(found, moving, arm.robot.joint_names, bounds)


def _physics(arm: Arm, data: tuple[Dataset, ...], bounds: CheckSettings) -> Stage:
    """What only the arm's dynamics tell: of each recording, and of all together."""
    chunks, moving = chunks_of(data), _moving(data)
    if arm.settings.delay_s:
        chunks = [c.with_torque_later(arm.settings.delay_s) for c in chunks]
    still = constant_joints(chunks, moving, bounds)
    judged = np.array([d.moving & ~still for d in data])
    together = Case(arm.robot, arm.terms, _probe(chunks, judged))
    remarks = conditioning_remarks(arm, data, chunks, together, bounds)
    parts = [[c for c in chunks if c.log == log] for log in range(len(data))]
    cases = [replace(together, probe=_probe(own, judged)) for own in parts]
    bound, both = bounds.condition_doubtful, list(zip(data, cases, strict=True))
    enough = [not (tells_too_little(c, bounds) or moves_as_one(c, bounds)) for c in cases]
    tells = [
        e and not remarks and scaled_condition(arm, [d], c) < bound
        for e, (d, c) in zip(enough, both, strict=True)
    ]
    asked = enough if len(data) == 1 else tells
    told = zip(cases, parts, asked, strict=True)
    signed = [_signed(case, own, t, bounds, arm.settings.delay_s or 0.0) for case, own, t in told]
    if len(data) > 1:
        signed = of_one_arm(together, signed, bounds)
    mended, in_ampere = [], arm.settings.torque_unit == "A"
    for one, case, own, found, judge in zip(data, cases, parts, signed, tells, strict=True):
        clipped = clipped_torque(case, own, bounds) if judge else []
        factors, more = _of_one(found, clipped, bounds, judge, in_ampere)
        mended.append(one if (factors == 1.0).all() else one.with_torque_times(factors))
        remarks += more if len(data) == 1 else [_named(r, one.name) for r in more]
    return tuple(mended), remarks


def _probe(chunks: Sequence[Chunk], moving: NDArray[np.bool_]) -> Probe:
    """The probe of chunks in whose recordings these joints move, shape (L, n)."""
    return probe_of(chunks, moving, _cutoff_hz(chunks, moving), _INSTANTS)


def _named(remark: Remark, name: str) -> Remark:
    return replace(remark, finding=f"{name}: {remark.finding}")


def _of_one(
    signed: Signed, clipped: list[Remark], bounds: CheckSettings, judge: bool, in_ampere: bool
) -> tuple[Array, list[Remark]]:
    """What one recording's torque is to be multiplied by, shape (n,), and what it shows.

    Args:
        signed: the recording without wrong signs.
        clipped: what is said of torque that ends at a largest value.
        bounds: of the checks.
        judge: whether the motion tells enough for its error to mean something.
        in_ampere: whether its torque was a current, whose size the URDF's weight has given.
    """
    case, remarks = signed.case, list(signed.remarks)
    if judge and not any(r.code in ("zero_pose", "gravity_direction") for r in remarks):
        case, more = by_weight(case, bounds)
        remarks += more
    remarks += clipped
    remarks += load_change_remarks(case, bounds) if judge and not remarks else []
    of_arm = another_arm(case, bounds) if judge and not remarks else []
    if judge and not remarks and not of_arm:
        remarks += position_remarks(case, bounds)
    factor, of_size = 1.0, []
    if not in_ampere:
        sizes = gains(case)
        factor = unit_factor(case, sizes, bounds) or 1.0
        cut = {j for r in clipped for j in r.joints}  # whose size clipping has taken
        told = unit_remarks(case, sizes, judge, bounds)
        of_size = [r for r in told if not r.joints or not cut.issuperset(r.joints)]
    remarks += _factors_once(of_arm, of_size)
    if judge:
        remarks += shifted_torque_zero(case, bounds)
        remarks += driving_friction(case, bounds)
        remarks += unexplained(case, bounds)
        remarks += [] if clipped else base_remarks(case, bounds)
    return signed.factors / factor, remarks


def _factors_once(of_arm: Sequence[Remark], of_size: Sequence[Remark]) -> list[Remark]:
    """Factors at single joints told once, and not where the links are of another size."""
    code = "current_not_torque"
    if any(r.code == "cad_disagrees" for r in of_arm):
        return [*of_arm, *(r for r in of_size if r.code != code)]
    by_weight = any(r.code == code for r in of_size)
    return [*(r for r in of_arm if not (by_weight and r.code == code)), *of_size]


def _cutoff_hz(chunks: Sequence[Chunk], moving: NDArray[np.bool_]) -> float:
    """Cut-off of the probe [Hz], from the motion."""
    frequencies = [0.0]
    for c in chunks:
        velocity = np.diff(c.q[:, moving[c.log]], axis=0)
        energy = np.abs(np.fft.rfft(velocity * np.hanning(len(velocity))[:, None], axis=0)) ** 2
        share = np.cumsum(energy, axis=0) / np.maximum(energy.sum(axis=0), 1e-300)
        frequency = np.fft.rfftfreq(len(velocity), 1 / c.rate_hz)
        frequencies += [frequency[int(np.argmax(s > _ENERGY))] for s in share.T]
    return float(np.clip(_OVER_MOTION * max(frequencies), *_CUTOFFS_HZ))


def _with_springs(case: Case, bounds: CheckSettings) -> Case:
    """The case with a spring at each joint, where they explain what would look like a fault."""
    sprung = replace(case, springs=True)
    if not sprung.better_by(bounds.believed_ratio, case):
        return case
    return sprung if sprung.error < least_error(case) else case


def _signed(
    case: Case, chunks: Sequence[Chunk], tells: bool, bounds: CheckSettings, delay_s: float
) -> Signed:
    """The case without wrong signs, and, if its motion tells parameters apart, swapped columns."""
    signs = np.ones(case.robot.dof)
    case = _with_springs(case, bounds)
    late = lag(case, chunks, bounds, delay_s) if tells else None
    case, reversed_, remarks = all_reversed(case, bounds)
    signs *= -1.0 if reversed_ else 1.0
    wrong = tells and (
        case.total > bounds.scan_from or bool((case.by_joint > bounds.scan_joint).any())
    )
    if late and not (wrong and least_error(case) < late.error_ratio * case.error):
        return Signed(case, signs, [*remarks, late.remark(case.robot.joint_names)])
    if wrong:
        case, found, more = scanned(case, bounds)
        if late and not found:
            return Signed(case, signs, [*remarks, late.remark(case.robot.joint_names)])
        remarks += more
        for h in found:
            signs *= h.torque_signs if h.torque_signs is not None else 1.0
        if any(h.grade is Grade.REFUSED for h in found):
            return Signed(case, signs, remarks)
    case, change, more = feeding_turned(case, tells, bounds)
    signs, remarks = signs * change, [*remarks, *more]
    if reversed_ and (signs > 0).any():
        remarks = said_once(remarks, signs, case.robot.joint_names)
    return Signed(case, signs, remarks)
