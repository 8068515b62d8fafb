"""Cogging and ripple: torque, or a share of it, that repeats with the motor's angle."""

from dataclasses import replace

import numpy as np

from ident.effects.effect import Array, Coefficient, FormUncertainty, Hypothesis, Setting, Value
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


class TorqueRipple:
    """tau = .. + T^T (a sin(k theta) + b cos(k theta)); or a drive that gives so much more."""

    id = "torque_ripple"
    title = "torque ripple that repeats with the motor's angle"
    equation = (
        "tau += T^T (a sin(k theta) + b cos(k theta)), theta = T q the motor's angle; or, where a"
        " motor drives one joint, it gives (1 + a sin(k theta) + b cos(k theta)) of its command"
    )
    source = "Piccoli, Yim 2016, eq. (1); ripple in proportion to the current: Jahns, Soong 1996"
    signature = "periodic in the motor's angle; strongest against the model in slow motion"
    rivals = ()
    contains = ()
    experiment = "turn the joint slowly, at constant speed, over several motor revolutions"
    compares = False
    freedom = FormUncertainty.ANY
    smooth = False
    uses = ("torque",)
    settings = (
        Setting("order", "1", tuple(float(k) for k in range(1, 25)), 1.0, 64.0, whole=True),
    )

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
        """One for each motor and order; where it drives one joint, also a share of its torque."""
        if arm.motor_from_joint is None:
            return []
        found = []
        for row in arm.motor_from_joint:
            joints = tuple(int(j) for j in np.flatnonzero(row) if arm.moving[j])
            if not joints or len(joints) > 2:
                continue
            unit = row / np.abs(row).max()
            place = {f"turn_{s}": float(row[j]) for s, j in zip("ab", joints, strict=False)}
            place |= {f"lever_{s}": float(unit[j]) for s, j in zip("ab", joints, strict=False)}
            forms = {"torque": "N m"} | ({"share": "1"} if np.count_nonzero(row) == 1 else {})
            for form, unit in forms.items():
                names = (Coefficient("sine", unit), Coefficient("cosine", unit))
                found += [
                    Hypothesis(self.id, joints, joints, names, {"order": k, **place}, form)
                    for k in self.settings[0].grid
                ]
        return found

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """Sine and cosine of a multiple of the motor's angle, through its levers, or of torque."""
        joints, settings = list(hypothesis.joints), hypothesis.settings
        turns = np.array([settings[f"turn_{s}"] for s, _ in zip("ab", joints, strict=False)])
        wave = _wave(seen, joints, turns, round(settings["order"]))
        parts = np.stack([wave.imag, wave.real], axis=-1)[:, None, :]
        if hypothesis.variant == "share":
            return parts * seen.tau[:, joints, None]
        levers = np.array([settings[f"lever_{s}"] for s, _ in zip("ab", joints, strict=False)])
        return parts * levers[:, None]

    def restated(self, hypothesis: Hypothesis, values: dict[str, Value]) -> dict[str, Value]:
        """What the drive gives more, where it is a share, not what it was asked for more."""
        if hypothesis.variant != "share":
            return values
        told = ("sine", "cosine")
        return {n: replace(v, value=-v.value) if n in told else v for n, v in values.items()}

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """A torque that repeats with the motor's angle; a share is one of the rigid-body torque."""
        settings, joints = hypothesis.settings, hypothesis.joints
        order = settings["order"]
        if hypothesis.variant == "share":
            numbers = (values[0], values[1], order * settings["turn_a"])
            return replace(arm, terms=(*arm.terms, Term(_share, joints[0], numbers)))
        other, there, lever = joints[0], 0.0, 0.0
        if len(joints) == 2:
            other, there, lever = joints[1], order * settings["turn_b"], settings["lever_b"]
        numbers = (
            values[0], values[1], order * settings["turn_a"], float(other), there,
            settings["lever_a"], lever,
        )  # fmt: skip
        return replace(arm, terms=(*arm.terms, Term(_ripple, joints[0], numbers)))


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
