"""Cogging and ripple: torque, or a share of it, that repeats with the motor's angle."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ident.effects.candidate import Candidate, Coefficient, NonlinearParameter, Value
from ident.effects.effect import Array, Effect, ExperimentMotion
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm, Term, term


@term
def _ripple(t, q, qd, load, joint, settings, resistance, level):
    here, other, there = settings[2], int(settings[3]), settings[4]
    angle = here * q[joint] + (there * q[other] if there != 0.0 else 0.0)
    torque = settings[0] * np.sin(angle) + settings[1] * np.cos(angle)
    resistance[joint] += settings[5] * torque
    if there != 0.0:
        resistance[other] += settings[6] * torque


@term
def _share(t, q, qd, load, joint, settings, resistance, level):
    angle = settings[2] * q[joint]
    resistance[joint] += (settings[0] * np.sin(angle) + settings[1] * np.cos(angle)) * load[joint]


_WAVE = "sine sin(order theta) + cosine cos(order theta)"
_TORQUE = f"tau += T^T ({_WAVE}), theta = T q the motor's angle"
_SHARE = f"it gives (1 + {_WAVE}) of its command"


class _Period(NamedTuple):
    """The wave's place.

    Attributes:
        order: waves in a turn of the motor.
        turns: of the motor with each joint.
        levers: of its torque to each joint, largest entry 1.
    """

    order: float
    turns: tuple[float, ...]
    levers: tuple[float, ...]


class TorqueRipple(Effect[_Period]):
    """tau = .. + T^T (a sin(k theta) + b cos(k theta)); or a drive that gives so much more."""

    id = "torque_ripple"
    title = "torque ripple that repeats with the motor's angle"
    equation = f"{_TORQUE}; or, where a motor drives one joint, {_SHARE}"
    source = "Piccoli, Yim 2016, eq. (1); ripple in proportion to the current: Jahns, Soong 1996"
    signature = "periodic in the motor's angle; strongest against the model in slow motion"
    experiment = "turn the joint slowly, at constant speed, over several motor revolutions"
    motion = ExperimentMotion.SLOW_REVERSALS
    depends_on = ("torque",)
    asks_of_arm = "how often each motor turns for its joint (`transmission`)"
    Parameters = _Period
    nonlinear = (
        NonlinearParameter(
            "order", "1", tuple(float(k) for k in range(1, 25)), 1.0, 64.0, discrete=True
        ),
    )

    def candidates(self, arm: ArmFacts) -> list[Candidate[_Period]]:
        """One for each motor and order; where it drives one joint, also a share of its torque."""
        if arm.motor_from_joint is None:
            return []
        found = []
        for row in arm.motor_from_joint:
            joints = tuple(int(j) for j in np.flatnonzero(row) if arm.moving[j])
            if not joints or len(joints) > 2:
                continue
            turns = tuple(float(row[j]) for j in joints)
            levers = tuple(turn / float(np.abs(row).max()) for turn in turns)
            forms = ("torque", "share") if np.count_nonzero(row) == 1 else ("torque",)
            found += [
                self.at(joints, _Period(k, turns, levers), form)
                for form in forms
                for k in self.nonlinear[0].grid
            ]
        return found

    def coefficients(self, parameters: _Period, variant: str) -> tuple[Coefficient, ...]:
        """Sine and cosine: a torque, or a share of it."""
        unit = "1" if variant == "share" else "N m"
        return Coefficient("sine", unit), Coefficient("cosine", unit)

    def columns(self, seen: Observed, candidate: Candidate[_Period]) -> Array:
        """Sine and cosine of a multiple of the motor's angle, through its levers, or of torque."""
        joints, shape = list(candidate.joints), candidate.parameters
        wave = _wave(seen, joints, np.array(shape.turns), round(shape.order))
        parts = np.stack([wave.imag, wave.real], axis=-1)[:, None, :]
        if candidate.variant == "share":
            return parts * seen.tau[:, joints, None]
        return parts * np.array(shape.levers)[:, None]

    def equation_of(self, candidate: Candidate[_Period]) -> str:
        """Of a torque, or of a share of it."""
        return f"the motor at angle theta: {_SHARE}" if candidate.variant == "share" else _TORQUE

    def as_reported(
        self, candidate: Candidate[_Period], values: dict[str, Value]
    ) -> dict[str, Value]:
        """What the drive gives more, where it is a share, not what it was asked for more."""
        if candidate.variant != "share":
            return values
        told = ("sine", "cosine")
        return {n: replace(v, value=-v.value) if n in told else v for n, v in values.items()}

    def simulated(
        self, arm: SimulatedArm, candidate: Candidate[_Period], values: Array
    ) -> SimulatedArm:
        """A torque that repeats with the motor's angle; a share is one of the rigid-body torque."""
        joints, (order, turns, levers) = candidate.joints, candidate.parameters
        sine, cosine, first = float(values[0]), float(values[1]), joints[0]
        angle = " + ".join(f"{order * x!r} * q[{j}]" for j, x in zip(joints, turns, strict=True))
        wave = f"({sine!r} * sin({angle}) + {cosine!r} * cos({angle}))"
        if candidate.variant == "share":
            text = ((first, f"{wave} * load[{first}]"),)
            item = Term(_share, first, (sine, cosine, order * turns[0]), text)
            return arm.with_terms(item)
        other, there, lever = first, 0.0, 0.0
        if len(joints) == 2:
            other, there, lever = joints[1], order * turns[1], levers[1]
        numbers = (sine, cosine, order * turns[0], float(other), there, levers[0], lever)
        text = tuple((j, f"{x!r} * {wave}") for j, x in zip(joints, levers, strict=True))
        return arm.with_terms(Term(_ripple, first, numbers, text))


def _wave(seen: Observed, joints: list[int], turns: Array, order: int) -> Array:
    """exp(i order theta), by multiplication from the order below."""
    name = f"wave {joints} {turns.tolist()} {order}"
    if name not in seen.memo:
        if order == 1:
            seen.memo[name] = np.exp(1j * (seen.q[:, joints] @ turns))
        else:
            one = _wave(seen, joints, turns, 1)
            seen.memo[name] = _wave(seen, joints, turns, order - 1) * one
    return seen.memo[name]


EFFECT = TorqueRipple()
