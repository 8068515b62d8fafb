"""The torque of a model's effects along a recording."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.dynamics.compiled_chain import chain_of
from ident.effects.bound_effects import members_of
from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.effects.observation import ArmFacts, Observed
from ident.effects.observing import CurrentModel, observed, on_links
from ident.effects.reversal_friction import MaxwellSlipMixture, reversal_speed, shapes_of
from ident.effects.smoothed_segment import EDGE_S, MOTION_HZ, SmoothedSegment, smoothed
from ident.model.identified_model import Model
from ident.recordings.dataset import Dataset, Segment, in_memory
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError

_LEAST_EDGE_S = 0.1
"""Left out at each end of a short segment at least [s]: the slowest filter's memory."""

_EDGES = 12
"""A segment's length in what is left out at either end, at least."""


def without_effects(model: Model, data: Dataset, motion_hz: float = MOTION_HZ) -> Dataset:
    """A recording with the torque of the model's effects taken off; without any, as it is.

    The ends of each span, where the motion cannot be smoothed, are left out.

    Args:
        model: the arm with its effects.
        data: the recording.
        motion_hz: cut-off of the motion that the torque is formed along; a lower one where the
            recorded torque is not filtered after it.

    Raises:
        DataError: an effect that is not known, or spans that are too short to smooth.
    """
    effects = members_of(model)
    if not effects:
        return data
    present = _present(model, data, effects)
    segments = [
        cleaned
        for s in data.segments
        if (cleaned := _cleaned(s, _smoothed(s, data.rate_hz, motion_hz), present, effects))
        is not None
    ]
    if not segments:
        raise DataError(f"{data.name}: too short to say what the model's effects do in it.")
    return in_memory(data, data.rate_hz, segments)


def _smoothed(segment: Segment, rate_hz: float, motion_hz: float) -> SmoothedSegment | None:
    """A segment with less left out at its ends where it is short: its torque need not be searched.

    Else nothing could be said of a recording of two seconds.
    """
    edge_s = max(_LEAST_EDGE_S, min(EDGE_S, len(segment.q) // _EDGES / rate_hz))
    return smoothed(segment, rate_hz, 0, motion_hz, edge_s)


def observed_along(model: Model, data: Dataset, motion: SmoothedSegment) -> tuple[Observed, Array]:
    """What effects look at along a stretch of a recording, and the torque of the whole model there.

    Links, friction that turns round as in the model's fit, and effects, all on the smoothed motion.

    Args:
        model: the arm with its effects.
        data: the recording.
        motion: a stretch of it, smoothed.

    Returns:
        the stretch, and the torque [N m], shape (S, n).

    Raises:
        DataError: an effect that is not known.
    """
    effects = members_of(model)
    seen = observed(motion, _present(model, data, effects), 1)[0]
    drives, value = model.terms.drive_matrix, model.parameter
    joints = value("fv") * motion.qd + value("fc") * seen.direction + value("fo")
    speed, change = motion.qd @ drives.T, motion.qdd @ drives.T
    motors = value("ia") * change + value("fvm") * speed + value("fcm") * np.sign(speed)
    return seen, seen.load + joints + motors @ drives + _effects_torque(seen, effects)


def _present(
    model: Model, data: Dataset, effects: Sequence[tuple[Candidate, Array]]
) -> CurrentModel:
    n = model.robot.dof
    tau = np.max([np.abs(s.tau).max(axis=0) for s in data.segments], axis=0)
    pose = np.nan_to_num(np.concatenate([s.q for s in data.segments]).mean(axis=0))
    facts = ArmFacts(
        chain_of(model.robot),
        model.inertial,
        None,
        model.moving,
        pose,
        tau,
        data.samples / data.rate_hz,
        commanded=data.torque == "commanded",
    )
    shapes = shapes_of(model.filter.reversals, n)
    slow = np.array([reversal_speed(MaxwellSlipMixture(parts).width) for parts in shapes])
    viscous, coulomb = model.parameter("fv"), model.parameter("fc")
    carried = on_links([h for h, _ in effects], [values for _, values in effects])
    return CurrentModel(facts, viscous, coulomb, shapes, slow, carried)


def _cleaned(
    segment: Segment,
    motion: SmoothedSegment | None,
    present: CurrentModel,
    effects: Sequence[tuple[Candidate, Array]],
) -> Segment | None:
    if motion is None:
        return None
    torque = _effects_torque(observed(motion, present, 1)[0], effects)
    edge = (len(segment.q) - len(torque)) // 2
    kept = slice(edge, edge + len(torque))
    first, end = segment.used or (0, len(segment.q))
    used = tuple(int(np.clip(i - edge, 0, len(torque))) for i in (first, end))
    reference = None if segment.reference is None else segment.reference[kept]
    return replace(
        segment,
        start_s=float(motion.t[0]),
        q=segment.q[kept],
        tau=segment.tau[kept] - torque,
        reference=reference,
        used=(used[0], used[1]),
    )


def _effects_torque(seen: Observed, effects: Sequence[tuple[Candidate, Array]]) -> Array:
    torque = np.zeros_like(seen.q)
    for h, values in effects:
        torque[:, list(h.rows)] += catalogue()[h.effect].columns(seen, h) @ values
    return torque
