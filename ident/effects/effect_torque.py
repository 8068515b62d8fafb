"""The torque of named effects along any motion, from the identified model alone."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.dynamics.compiled_chain import chain_of, torques
from ident.dynamics.regressor import Motion
from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.effects.observation import ArmFacts, Observed
from ident.model.identified_model import Model
from ident.signals.arrays import Array

Member = tuple[Candidate, Array]


def effect_torque(
    model: Model, members: Sequence[Member], motion: Motion, period_s: float | None
) -> Array:
    """Torque of effects beside rigid bodies and friction [N m], shape (S, n).

    First those on the links, then those that the drive has, and last those that need the whole
    torque: a delay, a clipped command, a share of it.

    Args:
        model: the arm.
        members: its effects, each with its coefficients.
        motion: S samples.
        period_s: between samples that follow each other [s]; None: each stands alone, and an
            effect with a memory is as it is after a long time at this speed.
    """
    total = np.zeros_like(motion.q)
    if not members:
        return total
    seen, still = _observation(model, motion, period_s), period_s is None
    for stage in range(3):
        added = np.zeros_like(total)
        for candidate, values in members:
            if _stage(candidate) == stage:
                effect = catalogue()[candidate.effect]
                form = effect.static_columns if still else effect.columns
                added[:, list(candidate.rows)] += form(seen, candidate) @ values
        total += added
        carried = total if stage == 0 else seen.carried
        seen = replace(seen, carried=carried, tau=seen.tau + added)
    return total


def _stage(candidate: Candidate) -> int:
    effect = catalogue()[candidate.effect]
    if effect.acts_on_link:
        return 0
    return 2 if "torque" in effect.depends_on else 1


def _observation(model: Model, motion: Motion, period_s: float | None) -> Observed:
    """What the model says about a motion, as effects look at it; friction turns round at once."""
    chain, delta = chain_of(model.robot), model.inertial
    q, qd, qdd = (np.ascontiguousarray(x) for x in (motion.q, motion.qd, motion.qdd))
    rest = np.zeros_like(q)
    load, gravity = torques(chain, delta, q, qd, qdd), torques(chain, delta, q, rest, rest)
    viscous, coulomb, direction = model.parameter("fv"), model.parameter("fc"), np.sign(qd)
    tau = load + viscous * qd + coulomb * direction
    n, step = model.robot.dof, period_s or 1.0
    facts = ArmFacts(
        chain=chain,
        delta=delta,
        motor_from_joint=None,
        moving=model.moving,
        pose=q.mean(axis=0),
        peak_torque=np.abs(tau).max(axis=0, initial=0.0),
        duration_s=len(q) * step,
        commanded=False,
    )
    return Observed(
        arm=facts,
        rate_hz=1.0 / step,
        t=np.arange(len(q)) * (0.0 if period_s is None else step),
        q=q,
        qd=qd,
        qdd=qdd,
        tau=tau,
        speed=qd,
        direction=direction,
        load=load,
        carried=np.zeros((len(q), n)),
        gravity=gravity,
        viscous=viscous,
        coulomb=coulomb,
        along=lambda _, speed: np.sign(speed),
    )
