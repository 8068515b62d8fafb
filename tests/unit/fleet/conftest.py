"""A small fleet of double pendulums, by Pinocchio and a friction of the tests' own."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from tests.pendulum import pendulum
from wamctl.arm.recorder import Recorder

RATE_HZ = 100.0
JOINTS = ("shoulder", "elbow")
DAY_NS = 86_400 * 10**9
START_NS = 1_767_254_400 * 10**9  # 2026-01-01 08:00 UTC


@dataclass(frozen=True)
class Arm:
    fc: np.ndarray
    fv: np.ndarray
    load: float = 0.0
    zero: float = 0.0


def ordinary(rng):
    return Arm(
        np.array([1.0, 0.5]) * np.exp(0.1 * rng.standard_normal(2)),
        np.array([0.4, 0.2]) * np.exp(0.1 * rng.standard_normal(2)),
        zero=0.002 * rng.standard_normal(),
    )


def write_log(path: Path, arm: Arm, day: int, rng, degrees: float = 24.0, seconds: float = 20.0):
    """A smooth wandering of both joints; friction falls by 0.5 % a kelvin."""
    model = pin.buildModelFromXML(pendulum())
    if arm.load:
        model.inertias[2] += pin.Inertia(arm.load, np.array([0.0, 0.0, -0.3]), np.zeros((3, 3)))
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    w = 2 * np.pi * rng.uniform(0.15, 0.5, (3, 2))
    a, phase = rng.uniform(0.3, 0.6, (3, 2)), rng.uniform(0, 6.28, (3, 2))
    wave = w * t[:, None, None] + phase
    q = (a * np.sin(wave)).sum(axis=1)
    qd = (a * w * np.cos(wave)).sum(axis=1)
    qdd = -(a * w**2 * np.sin(wave)).sum(axis=1)
    data = model.createData()
    real = q + np.array([0.0, arm.zero])
    tau = np.array([pin.rnea(model, data, *s) for s in zip(real, qd, qdd, strict=True)])
    warm = np.exp(-0.005 * (degrees - 24.0))
    tau += warm * (arm.fc * np.tanh(qd / 0.005) + arm.fv * qd) + 0.05 * rng.standard_normal(q.shape)
    path.parent.mkdir(parents=True, exist_ok=True)
    facts = {"temperature_c": f"{degrees:.2f}", "firmware": "1" if day < 6 else "2"}
    with Recorder(path, JOINTS, facts, {"robot.urdf": pendulum().encode()}) as log:
        for k in range(len(t)):
            stamp = START_NS + day * DAY_NS + round(k / RATE_HZ * 1e9)
            log.joint_states(stamp, q[k], None, tau[k])


@pytest.fixture(scope="session")
def logs(tmp_path_factory) -> Path:
    """Six arms, ten days each; the friction of one and the load of another change on day five."""
    folder = tmp_path_factory.mktemp("fleet") / "logs"
    for number in range(6):
        rng = np.random.default_rng(number)
        arm = ordinary(rng)
        for day in range(10):
            today = arm
            if number == 2 and day >= 5:
                today = replace(arm, fc=arm.fc * np.array([1.0, 1.3]))
            if number == 4 and day >= 5:
                today = replace(arm, load=0.3)
            degrees = 24.0 + 6.0 * np.sin(day + number)
            write_log(folder / f"arm{number}" / f"day{day}.mcap", today, day, rng, degrees)
    return folder
