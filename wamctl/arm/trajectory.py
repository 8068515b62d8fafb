"""The excitation's motion: Fourier series (46) of the paper, its file, and the reference."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from pydantic import Field, model_validator

from wamctl.arm.arrays import Array
from wamctl.arm.config import Positive, Section, Vector, find_file, read_yaml, validate


@dataclass(frozen=True)
class FourierSeries:
    """A periodic motion of n joints with L harmonics, (46).

    Attributes:
        joint_names: names of the n joints, from the base outwards.
        fundamental_rad_s: omega_f [rad/s].
        a, b: coefficients, shape (n, L) [rad/s].
        q0: centre of each joint's motion, shape (n,) [rad].
    """

    joint_names: tuple[str, ...]
    fundamental_rad_s: float
    a: Array
    b: Array
    q0: Array

    @property
    def period_s(self) -> float:
        """Length of one period [s]."""
        return 2 * np.pi / self.fundamental_rad_s

    @property
    def harmonics(self) -> int:
        """Number of harmonics L."""
        return self.a.shape[1]


@dataclass(frozen=True)
class Trajectory:
    """What a trajectory file holds.

    Attributes:
        series: the motion in steady state.
        periods: how many periods count.
        promise: what the designer computed of it, such as `condition_number` and `parameters`.
        limits: what it was designed under.
    """

    series: FourierSeries
    periods: int
    promise: dict[str, Any]
    limits: dict[str, Any]


@dataclass(frozen=True)
class Reference:
    """A sampled motion from rest to rest.

    Attributes:
        t: time since the start, shape (S,) [s].
        q, qd, qdd: position [rad], velocity [rad/s], acceleration [rad/s^2], each of shape (S, n).
        counted: the samples of the steady state; ramps lie before and after.
    """

    t: Array
    q: Array
    qd: Array
    qdd: Array
    counted: slice


def sample(series: FourierSeries, t: Array) -> tuple[Array, Array, Array]:
    """Position [rad], velocity [rad/s] and acceleration [rad/s^2] of (46), each of shape (S, n).

    Args:
        series: the motion.
        t: times, shape (S,) [s].
    """
    omega = series.fundamental_rad_s * np.arange(1, series.harmonics + 1)
    sin, cos = np.sin(np.outer(t, omega)), np.cos(np.outer(t, omega))
    a, b = series.a.T, series.b.T
    q = (sin / omega) @ a - (cos / omega) @ b + series.q0
    return q, cos @ a + sin @ b, (cos * omega) @ b - (sin * omega) @ a


def reference(series: FourierSeries, periods: int, ramp_s: float, period_s: float) -> Reference:
    """The motion from rest over the counted periods back to rest.

    The ramps follow the series' own path: the clock of (46) starts and stops smoothly, so that
    they meet no pose, and no velocity, beyond the series' own. Steady state is exactly (46), from
    its time zero.

    Args:
        series: the motion in steady state.
        periods: how many periods count.
        ramp_s: length of each ramp [s], rounded up to whole cycles.
        period_s: cycle time [s].
    """
    ramp = max(1, int(np.ceil(ramp_s / period_s - 1e-9)))
    count = round(periods * series.period_s / period_s)
    clock, rate, change = _starting_clock(ramp, period_s)
    steady = np.arange(count, dtype=float) * period_s
    theta = np.concatenate([clock[:-1], steady, count * period_s - clock[::-1]])
    speed = np.concatenate([rate[:-1], np.ones(count), rate[::-1]])[:, None]
    gain = np.concatenate([change[:-1], np.zeros(count), -change[::-1]])[:, None]
    q, qd, qdd = sample(series, theta)
    t = np.arange(len(theta), dtype=float) * period_s
    return Reference(t, q, qd * speed, qdd * speed**2 + qd * gain, slice(ramp, ramp + count))


def _starting_clock(ramp: int, period_s: float) -> tuple[Array, Array, Array]:
    """A clock that starts at rest and runs true, at zero, after `ramp` cycles.

    Its rate is the polynomial 10 u^3 - 15 u^4 + 6 u^5, so velocity and acceleration are smooth.

    Returns:
        clock [s], rate, and change of rate [1/s], each of shape (ramp + 1,).
    """
    u = np.arange(ramp + 1, dtype=float) / ramp
    length = ramp * period_s
    clock = length * (u**4 * (2.5 - 3 * u + u**2) - 0.5)
    return clock, u**3 * (10 - 15 * u + 6 * u**2), 30 * (u * (1 - u)) ** 2 / length


class TrajectoryFile(Section):
    """The YAML of a trajectory."""

    joints: tuple[str, ...] = Field(min_length=1, description="joint names, base outwards")
    fundamental_rad_s: Positive = Field(description="omega_f of (46) [rad/s]")
    a: tuple[Vector, ...] = Field(description="L sine coefficients per joint [rad/s]")
    b: tuple[Vector, ...] = Field(description="L cosine coefficients per joint [rad/s]")
    q0: Vector = Field(description="centre per joint [rad]")
    periods: int = Field(default=3, ge=1, description="counted periods")
    promise: dict[str, Any] = Field(default={}, description="figures the designer computed")
    limits: dict[str, Any] = Field(default={}, description="what it was designed under")

    @model_validator(mode="after")
    def _lengths_agree(self) -> "TrajectoryFile":
        n, harmonics = len(self.joints), len(self.a[0]) if self.a else 0
        faults = [
            f"{name}: {len(value)} entries for {n} joints"
            for name, value in (("a", self.a), ("b", self.b), ("q0", self.q0))
            if len(value) != n
        ]
        faults += [
            f"{name}: {len(row)} coefficients for joint {joint}, {harmonics} for joint 1"
            for name, rows in (("a", self.a), ("b", self.b))
            for joint, row in enumerate(rows, 1)
            if len(row) != harmonics
        ]
        if harmonics == 0:
            faults.append("a: at least one harmonic is needed")
        if faults:
            raise ValueError("; ".join(faults))
        return self

    @property
    def trajectory(self) -> Trajectory:
        """What it describes."""
        a, b, q0 = (np.array(x) for x in (self.a, self.b, self.q0))
        series = FourierSeries(self.joints, self.fundamental_rad_s, a, b, q0)
        return Trajectory(series, self.periods, self.promise, self.limits)


def read_trajectory(path: str | Path) -> Trajectory:
    """The trajectory of a file, or of the shipped file of that bare name.

    Raises:
        ConfigurationError: missing or broken file, or all faults of its content at once.
    """
    found = find_file(path)
    return validate(TrajectoryFile, read_yaml(found), found).trajectory


def trajectory_yaml(trajectory: Trajectory) -> str:
    """The text of a trajectory file; every number survives to its last bit."""
    series = trajectory.series
    content = {
        "joints": list(series.joint_names),
        "fundamental_rad_s": series.fundamental_rad_s,
        "a": series.a.tolist(),
        "b": series.b.tolist(),
        "q0": series.q0.tolist(),
        "periods": trajectory.periods,
        "promise": trajectory.promise,
        "limits": trajectory.limits,
    }
    return yaml.safe_dump(content, sort_keys=False, width=100, default_flow_style=None)


def write_trajectory(path: str | Path, trajectory: Trajectory) -> None:
    """Write a trajectory file, replacing an older one only when the new one is whole."""
    path = Path(path)
    draft = path.with_name(f".{path.name}.part")
    draft.write_text(trajectory_yaml(trajectory), encoding="utf-8")
    draft.replace(path)
