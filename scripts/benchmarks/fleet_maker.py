#!/usr/bin/env -S .venv/bin/python
"""Makes a fleet: arms of one type with scatter, a short ordinary motion a day, planted changes.

Usage: scripts/benchmarks/fleet_maker.py OUT [--arms 200] [--days 50] [--changed 0.01]
           [--moves 14] [--seed 0] [--part 0:20]

Torque is Pinocchio's inverse dynamics along point-to-point moves as a servo follows them, plus
friction of a form of its own, plus noise: nothing of `ident` takes part. What was planted stands in
OUT/planted.json; logs in OUT/logs/ARM/DAY.mcap.
"""

import argparse
import json
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from wamctl.arm.config import find_file
from wamctl.arm.recorder import Recorder
from wamctl.arm.robot import Robot, load_robot

Array = NDArray[np.floating]

RATE_HZ = 250.0
FIRST_DAY_NS = 1_767_254_400_000_000_000  # 2026-01-01 08:00 UTC
DAY_NS = 86_400_000_000_000
KINDS = ("friction", "stribeck", "payload", "zero")

COULOMB = np.array([1.9, 1.5, 1.3, 1.2, 0.45, 0.42, 0.12])  # [N m]
VISCOUS = np.array([0.8, 0.7, 0.6, 0.5, 0.08, 0.08, 0.02])  # [N m s/rad]
REACH = np.array([0.9, 0.6, 0.9, 0.7, 1.1, 0.7, 1.2])  # [rad]
CENTRE = np.array([0.0, 0.6, 0.0, 1.4, -1.0, 0.0, 0.0])  # [rad]
NOISE = np.array([0.25, 0.25, 0.2, 0.15, 0.04, 0.04, 0.015])  # [N m], each sample
PER_KELVIN = -0.006
TURN = 2 * np.pi / np.array([42.0, 28.25, 28.25, 18.0, 9.7, 9.7, 14.93])
"""One turn of each joint's motor [rad] (libbarrett's ratios).

A zero is lost by whole ones: the stored angle of the rotor mends only what is less than half a turn
(Barrett's calibration page; OWD's documentation).
"""


@dataclass(frozen=True)
class Truth:
    """One arm on one day.

    Attributes:
        inertias: of the links.
        coulomb, viscous, extra: friction, its part at low speed among it, each of shape (n,).
        stribeck_speed: [rad/s].
        zero: what the encoders read too little [rad], shape (n,).
    """

    inertias: tuple[pin.Inertia, ...]
    coulomb: Array
    viscous: Array
    extra: Array
    zero: Array
    stribeck_speed: float = 0.08

    def friction(self, qd: Array) -> Array:
        """Torque [N m], shape (S, n): saturating drag, a dip, and a level."""
        size = np.abs(qd)
        level = self.coulomb + self.extra / (1.0 + (size / self.stribeck_speed) ** 2)
        drag = self.viscous * qd / (1.0 + 0.15 * size)
        return level * np.tanh(qd / 0.008) + drag


def arm(model: pin.Model, rng: np.random.Generator) -> Truth:
    """An arm of the type."""
    inertias = []
    for k in range(1, model.njoints):
        link = model.inertias[k]
        mass = link.mass * (1 + 0.02 * rng.standard_normal())
        lever = link.lever + 0.002 * rng.standard_normal(3)
        inertias.append(pin.Inertia(mass, lever, link.inertia * (mass / link.mass)))
    n = model.nq
    return Truth(
        tuple(inertias),
        COULOMB * np.exp(0.15 * rng.standard_normal(n)),
        VISCOUS * np.exp(0.15 * rng.standard_normal(n)),
        0.1 * COULOMB * np.exp(0.3 * rng.standard_normal(n)),
        0.002 * rng.standard_normal(n),
    )


def changed(truth: Truth, kind: str, joint: int, rng: np.random.Generator) -> tuple[Truth, dict]:
    """The arm after a change, and what it is."""
    n = len(truth.coulomb)
    here = np.arange(n) == joint
    if kind == "friction":
        up = np.where(here, 1.1, 1.0)
        after = replace(truth, coulomb=truth.coulomb * up, viscous=truth.viscous * up)
        return after, {"joint": joint + 1, "share": 0.1}
    if kind == "stribeck":
        extra = 0.3 * COULOMB[joint]
        return replace(truth, extra=truth.extra + extra * here), {
            "joint": joint + 1,
            "extra": extra,
        }
    if kind == "zero":
        turn = TURN[joint] * rng.choice([-1.0, 1.0])
        return replace(truth, zero=truth.zero + turn * here), {"joint": joint + 1, "rad": turn}
    mass, centre = 0.5, np.array([0.02, -0.01, 0.06])
    last = truth.inertias[-1] + pin.Inertia(mass, centre, np.zeros((3, 3)))
    return replace(truth, inertias=(*truth.inertias[:-1], last)), {"kg": mass}


def motion(rng: np.random.Generator, route: Array) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration along a route with pauses, each of shape (S, n)."""
    parts = []
    points = route + 0.05 * rng.standard_normal(route.shape)
    for a, b in pairwise(points):
        time = max(1.0, float(np.max(np.abs(b - a)) / rng.uniform(0.5, 0.9)))
        s = np.linspace(0.0, 1.0, round(time * RATE_HZ), endpoint=False)
        way = 10 * s**3 - 15 * s**4 + 6 * s**5
        parts += [a + way[:, None] * (b - a), np.repeat(b[None], round(0.15 * RATE_HZ), axis=0)]
    q = np.concatenate(parts)
    spectrum = np.fft.rfft(np.concatenate([q, q[::-1]]), axis=0)  # the servo's own low-pass
    f = np.fft.rfftfreq(2 * len(q), 1 / RATE_HZ)
    soft = 1.0 / (1.0 + (f / 6.0) ** 4)
    rate = 2j * np.pi * f
    found = [np.fft.irfft(spectrum * (soft * rate**k)[:, None], axis=0)[: len(q)] for k in range(3)]
    return found[0], found[1], found[2]


def torque(model: pin.Model, truth: Truth, q: Array, qd: Array, qdd: Array) -> Array:
    """Joint torque [N m], shape (S, n), of the arm where it really is."""
    for k, inertia in enumerate(truth.inertias, 1):
        model.inertias[k] = inertia
    data = model.createData()
    real = q + truth.zero
    rows = [pin.rnea(model, data, *s) for s in zip(real, qd, qdd, strict=True)]
    return np.array(rows) + truth.friction(qd)


def write(path: Path, model: pin.Model, names: tuple[str, ...], truth: Truth, day: tuple) -> None:
    """One log.

    Args:
        path: the file.
        model: of the type; its inertias are replaced.
        names: of the joints.
        truth: the arm on this day.
        day: its number, temperature [deg C], route, and random generator.
    """
    number, degrees, route, rng = day
    warm = np.exp(PER_KELVIN * (degrees - 24.0)) * (1 + 0.01 * rng.standard_normal(len(names)))
    today = replace(
        truth, coulomb=truth.coulomb * warm, viscous=truth.viscous * warm, extra=truth.extra * warm
    )
    q, qd, qdd = motion(rng, route)
    tau = torque(model, today, q, qd, qdd) + NOISE * rng.standard_normal(q.shape)
    read = np.round(q / 3e-5 + 0.3 * rng.standard_normal(q.shape)) * 3e-5
    start = FIRST_DAY_NS + number * DAY_NS + int(rng.integers(0, 3600)) * 10**9
    stamps = start + np.round(np.arange(len(q)) / RATE_HZ * 1e9).astype(np.int64)
    facts = {"temperature_c": f"{degrees:.1f}", "firmware": "1.0" if number < 30 else "1.1"}
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    with Recorder(part, names, facts) as log:
        for stamp, position, effort in zip(stamps.tolist(), read, tau, strict=True):
            log.joint_states(stamp, position, None, effort)
    part.replace(path)


@dataclass(frozen=True)
class Days:
    """An arm's days.

    Attributes:
        seed: of its random numbers.
        degrees: temperature of each day [deg C].
        route: of its moves, shape (moves, n).
    """

    seed: tuple[int, int]
    degrees: list[float]
    route: Array

    def write(self, path: Path, robot: Robot, truth: Truth, day: int) -> None:
        """The log of a day."""
        random = np.random.default_rng((*self.seed, day))
        one = (day, self.degrees[day], self.route, random)
        write(path, robot.model.copy(), robot.joint_names, truth, one)


def days(seed: tuple[int, int], own: np.random.Generator, count: int, moves: int) -> Days:
    """An arm's days, after its own numbers have been drawn."""
    route = CENTRE + REACH * own.uniform(-1, 1, (moves, len(CENTRE)))
    degrees = [24.0 + 5.0 * np.sin(d / 9.0) + 3.0 * own.standard_normal() for d in range(count)]
    return Days(seed, degrees, route)


def wam() -> Robot:
    """The type."""
    return load_robot(find_file(Path("wam7.urdf")).read_text(encoding="utf-8"), WAM)


def main() -> None:
    """Makes the logs, arm by arm."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--arms", type=int, default=200)
    parser.add_argument("--days", type=int, default=50)
    parser.add_argument("--changed", type=float, default=0.01, help="share of the arms")
    parser.add_argument("--moves", type=int, default=14, help="of a log, two seconds each")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--part", default=":", help="the arms of it to make now, as 0:20")
    given = parser.parse_args()
    robot = wam()
    rng = np.random.default_rng(given.seed)
    which = rng.permutation(given.arms)[: max(1, round(given.changed * given.arms))].tolist()
    now = range(given.arms)[slice(*(int(n) if n else None for n in given.part.split(":")))]
    planted = []
    for number in range(given.arms):
        own = np.random.default_rng((given.seed, number))
        truth = arm(robot.model.copy(), own)
        name, after, from_day = f"arm{number:04d}", truth, given.days
        if number in which:
            kind = KINDS[which.index(number) % len(KINDS)]
            first = given.days // 4
            from_day = int(own.integers(first, max(given.days - 10, first + 1)))
            after, what = changed(truth, kind, int(own.integers(0, 6)), own)
            planted.append({"arm": name, "kind": kind, "day": from_day, **what})
        plan = days((given.seed, number), own, given.days, given.moves)
        for day in range(given.days):
            path = given.out / "logs" / name / f"{day:04d}.mcap"
            if number in now and not path.exists():  # an earlier call was stopped
                plan.write(path, robot, truth if day < from_day else after, day)
    (given.out / "planted.json").write_text(json.dumps(planted, indent=1), encoding="utf-8")


WAM = (
    "wam/base_yaw_joint",
    "wam/shoulder_pitch_joint",
    "wam/shoulder_yaw_joint",
    "wam/elbow_pitch_joint",
    "wam/wrist_yaw_joint",
    "wam/wrist_pitch_joint",
    "wam/palm_yaw_joint",
)

if __name__ == "__main__":
    main()
