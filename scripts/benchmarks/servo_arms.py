"""Simulated hobby arms with one hidden effect each, or none, searched by `ident gap`'s simulation.

Run: .venv/bin/python scripts/benchmarks/servo_arms.py [--arms N] [--none N] [--seed N] [--first N]

Six joints with the SO-101's links move in MuJoCo; servo, friction, gears and what is hidden are
this script's own: 50 Hz, 12 bit, a drawn gain, damping, delay, rotor and friction each. Friction
turns round in one of three ways that the tool does not have (bristles, a smooth sign, one with a
small rise). Prints a line an arm, with how many of its 90 % intervals hold (gains, rotors and
friction of joints 1 to 5, and the hidden size), then the counts; `--first` leaves out the arms
before, so that a count that was stopped can go on.
"""

import argparse
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

import ident
from ident.api.servos import ServoGap
from ident.output_error.parameters import ROW

Array = NDArray[np.floating]

URDF = Path(__file__).parents[2] / "configs" / "so101.urdf"
STEP_S, PERIOD_STEPS = 0.0001, 200  # steps of 0.5 ms pass for 0.25 ms less delay, 0.7 % less rotor
LOOSE = "backlash", "joint_elasticity"
TICK = 2 * np.pi / 4096
Z90 = 1.645
BRISTLE_RAD = 1e-3
LINK_SIDE = 2e-3
"""Of a loose joint's gears [kg m^2], what moves with its link; the drawn rotor is beside it."""
EFFECTS = {
    "torque_offset": ((0.1, 0.25), range(5)),
    "stribeck": ((0.8, 1.6), range(5)),
    "load_dependent_friction": ((0.2, 0.4), (1, 2)),
    "backlash": ((0.005, 0.012), range(5)),
    "joint_elasticity": ((0.01, 0.03), (1, 2)),
    "encoder_offset": ((0.1, 0.2), (1, 2, 3)),
    "joint_spring": ((0.15, 0.4), range(5)),
    "nonlinear_viscous": ((0.15, 0.4), range(5)),
    "asymmetric_viscous": ((0.15, 0.35), range(5)),
}
"""Range of each size (Stribeck: of the Coulomb friction), and joints at which it can be seen."""

REPORTED = {
    "torque_offset": "offset", "stribeck": "extra_friction", "backlash": "half_play",
    "load_dependent_friction": "coefficient", "joint_elasticity": "compliance",
    "encoder_offset": "offset", "joint_spring": "stiffness", "nonlinear_viscous": "drag",
    "asymmetric_viscous": "half_difference",
}  # fmt: skip


@dataclass(frozen=True)
class Truth:
    """An arm: what it is made of, shape (6,) each, and what is hidden at which joint."""

    gain: Array
    damping: Array
    friction: Array
    rotor: Array
    delay: float
    turning: str
    effect: str
    joint: int
    size: float


def drawn(rng: np.random.Generator, effect: str) -> Truth:
    """An arm of random values; an empty effect hides nothing."""
    low_high, joints = EFFECTS.get(effect, ((0.0, 0.0), (0,)))
    friction = rng.uniform(0.06, 0.14, 6)
    joint = int(rng.choice(list(joints)))
    size = rng.uniform(*low_high) * (friction[joint] if effect == "stribeck" else 1.0)
    return Truth(
        rng.uniform(12.0, 22.0) * rng.uniform(0.95, 1.05, 6),
        rng.uniform(0.5, 0.8) * rng.uniform(0.9, 1.1, 6),
        friction,
        rng.uniform(0.015, 0.03, 6),
        int(rng.integers(10, 60)) * 0.0005,
        str(rng.choice(["bristles", "smooth", "rising"])),
        effect,
        joint,
        float(size),
    )


def commands(rng: np.random.Generator, seconds: float) -> Array:
    """Slow and fast sines, holds and steps at 50 Hz, shape (S, 6)."""
    t = np.arange(int(seconds * 50)) / 50
    hz, size = np.array([0.07, 0.17, 0.43, 1.1]), np.array([0.45, 0.2, 0.12, 0.05])
    wave = np.sin(2 * np.pi * hz * t[:, None, None] + rng.uniform(0, 6.28, (6, 4))) @ size
    hold = 0.35 * rng.standard_normal((len(t) // 75 + 1, 6))
    steps = np.repeat(hold, 75, axis=0)[: len(t)]
    part = (np.floor(t / 15) % 2 == 1)[:, None]
    return np.array([0.0, 0.3, -0.2, 0.2, 0.0, 0.5]) + np.where(part, steps, wave)


class Gears:
    """Rotor, friction and gears of all joints, one explicit step after the other."""

    def __init__(self, truth: Truth, arm: mujoco.MjModel, q: Array) -> None:
        self.truth, self.bristle = truth, np.zeros(6)
        self.loose = truth.effect in LOOSE
        self.at, self.speed = float(q[truth.joint]), 0.0
        j = truth.joint
        if self.loose:  # the rotor is its own
            arm.dof_armature[j] = LINK_SIDE
        self.tie = 1 / truth.size if truth.effect == "joint_elasticity" else 400.0
        self.half = truth.size if truth.effect == "backlash" else 0.0

    def friction(self, v: Array, load: Array) -> Array:
        """Dry friction at the rotors' speeds [N m], shape (6,)."""
        x, level = self.truth, self.truth.friction.copy()
        j = x.joint
        if x.effect == "stribeck":
            level[j] += x.size * np.exp(-abs(v[j]) / 0.12)
        if x.effect == "load_dependent_friction":
            level[j] += x.size * abs(load[j])
        if x.turning == "bristles":
            self.bristle += STEP_S * v * (1 - np.sign(v) * self.bristle / BRISTLE_RAD)
            self.bristle = np.clip(self.bristle, -BRISTLE_RAD, BRISTLE_RAD)
            return level * self.bristle / BRISTLE_RAD
        if x.turning == "known":
            return level * np.clip(v / 0.006, -1.0, 1.0)
        if x.turning == "smooth":
            return level * np.tanh(v / 0.008)
        return level * v / (np.abs(v) + 0.004)

    def torque(self, error: Array, q: Array, v: Array, load: Array) -> Array:
        """What the links feel [N m], shape (6,)."""
        x, j = self.truth, self.truth.joint
        speed = v.copy()
        if self.loose:
            speed[j] = self.speed
        given = np.clip(x.gain * error, -3.0, 3.0) - x.damping * speed - self.friction(speed, load)
        extra = {
            "torque_offset": -x.size,
            "joint_spring": -x.size * q[j],
            "nonlinear_viscous": -x.size * speed[j] * abs(speed[j]),
            "asymmetric_viscous": -x.size * abs(speed[j]),
        }
        given[j] += extra.get(x.effect, 0.0)
        if self.loose:
            twist = self.at - q[j]
            beyond = twist - np.clip(twist, -self.half, self.half)
            through = self.tie * beyond + (0.5 * (self.speed - v[j]) if beyond else 0.0)
            self.speed += STEP_S * (given[j] - through) / x.rotor[j]
            self.at += STEP_S * self.speed
            given[j] = through
        return given


def recorded(truth: Truth, rng: np.random.Generator, seconds: float) -> ident.Recording:
    """The log of an arm."""
    arm = mujoco.MjModel.from_xml_path(str(URDF))
    arm.opt.timestep, arm.opt.integrator = STEP_S, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    arm.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    arm.jnt_limited[:] = 0
    arm.dof_armature[:] = truth.rotor
    state, wanted = mujoco.MjData(arm), commands(rng, seconds)
    zero = np.zeros(6)
    if truth.effect == "encoder_offset":
        zero[truth.joint] = truth.size
    state.qpos[:] = wanted[0] + zero
    gears, told = Gears(truth, arm, state.qpos), np.empty_like(wanted)
    late = round(truth.delay / STEP_S)
    for k in range(len(wanted) * PERIOD_STEPS):
        if k % PERIOD_STEPS == 0:
            told[k // PERIOD_STEPS] = np.round((state.qpos - zero) / TICK) * TICK
        goal = wanted[max(k - late, 0) // PERIOD_STEPS] + zero
        error = goal - np.round(state.qpos / TICK) * TICK
        load = state.qfrc_bias
        state.qfrc_applied[:] = gears.torque(error, state.qpos, state.qvel, load)
        mujoco.mj_step(arm, state)
    names = tuple(arm.joint(i).name for i in range(6))
    t = np.arange(len(told)) / 50 + rng.uniform(-1e-3, 1e-3, len(told))
    return ident.Recording(t=t, q=told, joints=names, q_command=wanted, name="arm")


def judged(truth: Truth, gap: ServoGap) -> tuple[str, dict[str, list[bool]]]:
    """One word for the answer, and which 90 % intervals hold, by kind."""
    found = [(e["name"], e["joints"]) for e in gap.content["effects"]]
    right = [(truth.effect, [truth.joint + 1])] if truth.effect else []
    if gap.verdict == "named":
        word = "right" if found == right else "WRONG"
    elif gap.verdict == "no_gap":
        word = "missed" if right else "silent"
    else:
        word = gap.verdict + ("+" if right and right[0] in found else "")
    model, held, rotors = gap.model, {}, truth.rotor.copy()
    if truth.effect in LOOSE:
        rotors[truth.joint] += LINK_SIDE
    for name, true in (("stiffness", truth.gain), ("armature", rotors),
                       ("coulomb", truth.friction)):  # fmt: skip
        sd = model.sd[ROW[name]]
        held[name] = (np.abs(model.value(name) - true) < Z90 * sd)[:5].tolist()
    for e in gap.content["effects"] if word in ("right", "ambiguous+") else ():
        if (e["name"], e["joints"]) in right:
            size = e["parameters"][REPORTED[e["name"]]]
            held["size"] = [abs(abs(size["value"]) - truth.size) < Z90 * size["sd"]]
    return word, held


def sized(effect: dict[str, Any]) -> str:
    """An effect with its joint, size and standard deviation."""
    size = effect["parameters"][REPORTED[effect["name"]]]
    return f"{effect['name']}:{effect['joints'][0]} {size['value']:.4g} ± {size['sd']:.2g}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--arms", type=int, default=len(EFFECTS))
    parser.add_argument("--none", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=60.0)
    asked = parser.parse_args()
    names = [list(EFFECTS)[i % len(EFFECTS)] for i in range(asked.arms)] + [""] * asked.none
    arm, words, holds = ident.Arm.from_urdf(URDF), [], {}
    for k, effect in list(enumerate(names))[asked.first :]:
        rng = np.random.default_rng([asked.seed, k])
        truth = drawn(rng, effect)
        recording = recorded(truth, rng, asked.seconds)
        start = time.process_time()
        gap = ident.find_gap(arm, recording, method="simulation", null_runs=2)
        word, held = judged(truth, gap)
        words.append(word)
        for kind, some in held.items():
            holds.setdefault(kind, []).extend(some)
        right = " ".join(f"{kind} {sum(some)}/{len(some)}" for kind, some in held.items())
        what = f"{effect or 'nothing'} {truth.size:.3g} at {truth.joint + 1}, {truth.turning}"
        told = ", ".join(sized(e) for e in gap.content["effects"])
        spent = time.process_time() - start
        print(
            f"{word:10s} {what:50s} told: {gap.verdict} {told} | {right} ({spent:.0f} s)",
            flush=True,
        )
    print({word: words.count(word) for word in dict.fromkeys(words)})
    for kind, some in holds.items():
        print(f"90 % intervals of {kind} that hold: {np.mean(some):.0%} of {len(some)}")


if __name__ == "__main__":
    main()
