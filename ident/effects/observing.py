"""Observations of a segment beside the current model, as effects form their columns from them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.dynamics.compiled_chain import torques, weights
from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.effects.observation import ArmFacts, Observed
from ident.effects.reversal_friction import MaxwellSlipMixture
from ident.effects.smoothed_segment import SmoothedSegment
from ident.signals.arrays import Array


@dataclass(frozen=True)
class CurrentModel:
    """What the columns of effects are formed with.

    Attributes:
        facts: of the arm, with the present inertial parameters.
        viscous, coulomb: joint friction, each of shape (n,).
        shapes: parts of the reversal curves of each joint, shape (n, T).
        slow: speed below which each joint counts as turning [rad/s], shape (n,).
        carried: effects that act on the links, with their coefficients.
    """

    facts: ArmFacts
    viscous: Array
    coulomb: Array
    shapes: Array
    slow: Array
    carried: tuple[tuple[Candidate, Array], ...] = ()


def on_links(
    effects: Sequence[Candidate], values: Sequence[Array]
) -> tuple[tuple[Candidate, Array], ...]:
    """Those effects that act on the links, with their coefficients."""
    pairs = zip(effects, values, strict=True)
    return tuple((h, v) for h, v in pairs if catalogue()[h.effect].acts_on_link)


def observed(s: SmoothedSegment, model: CurrentModel, every: int) -> tuple[Observed, Observed]:
    """What effects may look at in a stretch: all samples, and every so-manieth.

    The model's torque varies as slowly as the links move; between its samples it is interpolated.
    """
    facts = model.facts
    middle = slice(every // 2, None, every)
    q, qd, qdd = (np.ascontiguousarray(a[middle]) for a in (s.q, s.qd, s.qdd))
    load = torques(facts.chain, facts.delta, q, qd, qdd)
    gravity = weights(facts.chain, facts.delta, q) @ facts.chain.gravity
    carried = np.zeros_like(q)
    curves = (MaxwellSlipMixture(parts) for parts in model.shapes)
    direction = np.stack([m(s.q[:, j], s.speeds[..., j]) for j, m in enumerate(curves)], axis=-1)
    coarse = _seen(s, model, middle, direction, (load, carried, gravity))
    for h, values in model.carried:
        carried[:, list(h.rows)] += catalogue()[h.effect].columns(coarse, h) @ values
    fine = tuple(
        np.column_stack([np.interp(s.t, coarse.t, column) for column in part.T])
        for part in (load, carried, gravity)
    )
    return _seen(s, model, slice(None), direction, (fine[0], fine[1], fine[2])), coarse


def _seen(
    s: SmoothedSegment,
    model: CurrentModel,
    samples: slice,
    direction: Array,
    torque: tuple[Array, Array, Array],
) -> Observed:
    shapes = [MaxwellSlipMixture(parts) for parts in model.shapes]
    speed = [s.speeds[m.cutoff, samples, j] for j, m in enumerate(shapes)]
    friction = model.viscous * s.qd[samples] + model.coulomb * direction[samples]
    return Observed(
        arm=model.facts,
        rate_hz=s.rate_hz / (samples.step or 1),
        t=s.t[samples],
        q=s.q[samples],
        qd=s.qd[samples],
        qdd=s.qdd[samples],
        tau=s.tau[samples] if model.facts.commanded else torque[0] + friction,
        speed=np.stack(speed, axis=-1),
        direction=direction[samples],
        load=torque[0],
        carried=torque[1],
        gravity=torque[2],
        viscous=model.viscous,
        coulomb=model.coulomb,
        along=lambda joint, other: shapes[joint].along(other),
    )
