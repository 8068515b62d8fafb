"""The torque of a model's effects along a recording."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.dynamics.compiled_chain import chain_of
from ident.effects.bound_effects import members_of
from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.effects.observation import ArmFacts
from ident.effects.observing import CurrentModel, observed, on_links
from ident.effects.reversal_friction import MaxwellSlipMixture, reversal_speed, shapes_of
from ident.effects.smoothed_segment import SmoothedSegment, smoothed
from ident.model.identified_model import Model
from ident.recordings.dataset import Dataset, Segment, in_memory
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError


def without_effects(model: Model, data: Dataset) -> Dataset:
    """A recording with the torque of the model's effects taken off.

    The ends of each span, where the motion cannot be smoothed, are left out.

    Raises:
        DataError: an effect that is not known, or spans that are too short to smooth.
    """
    effects = members_of(model)
    present = _present(model, data, effects)
    segments = [
        cleaned
        for s in data.segments
        if (cleaned := _cleaned(s, smoothed(s, data.rate_hz, 0), present, effects)) is not None
    ]
    if not segments:
        raise DataError(f"{data.name}: too short to say what the model's effects do in it.")
    return in_memory(data, data.rate_hz, segments)


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
    seen = observed(motion, present, 1)[0]
    torque = np.zeros_like(motion.tau)
    for h, values in effects:
        torque[:, list(h.rows)] += catalogue()[h.effect].columns(seen, h) @ values
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
