"""What an investigation may cost, declared before it begins."""

import re
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from wamctl.arm.recording import read_recording
from wamctl.arm.transmission import Transmission
from wamctl.errors import UsageError

_UNITS_S = {"s": 1.0, "min": 60.0, "h": 3600.0}


@dataclass(frozen=True)
class Cost:
    """What motion has cost.

    Attributes:
        motion_s: time of motion, approach and return included [s].
        energy_j: mechanical work of the motors, both ways [J].
        motor_load: largest share of a motor's continuous torque, as rms over a run [1].
        stops: runs that a limit has ended.
    """

    motion_s: float = 0.0
    energy_j: float = 0.0
    motor_load: float = 0.0
    stops: int = 0

    def plus(self, other: "Cost") -> "Cost":
        """Both together."""
        return Cost(
            self.motion_s + other.motion_s,
            self.energy_j + other.energy_j,
            max(self.motor_load, other.motor_load),
            self.stops + other.stops,
        )


@dataclass(frozen=True)
class Budget:
    """The bounds.

    Attributes:
        wall_s: time on the clock, that of all sessions together [s].
        motion_s: time of motion [s].
        energy_j: mechanical work of the motors [J].
        motor_load: rms torque of each motor in units of its continuous one [1]; its heat grows
            with the square.
        stops: runs that a limit may end.
        motions: motions after the first, those that the operator made room for aside.
        answers: how often the operator is asked to do something to the arm.
    """

    wall_s: float = 1200.0
    motion_s: float = 600.0
    energy_j: float = 3000.0
    motor_load: float = 1.0
    stops: int = 2
    motions: int = 3
    answers: int = 2

    def passed(self, cost: Cost, wall_s: float, motions: int) -> str | None:
        """Which bound is reached, in words; None while there is room for one more motion."""
        used = asdict(cost) | {"wall_s": wall_s, "motions": motions}
        for name, most in asdict(self).items():
            if name not in used:
                continue
            full = used[name] > most if name in ("motor_load", "stops") else used[name] >= most
            if full:
                return f"{name} is {used[name]:.4g} of {most:.4g}"
        return None

    def rounds_left(self, cost: Cost, wall_s: float, motions: int, rounds: int) -> int:
        """How many more motions there is room for, if each costs what those before did.

        Args:
            cost: of all rounds.
            wall_s: time on the clock [s].
            motions: after the first.
            rounds: how many there were.
        """
        used = asdict(cost) | {"wall_s": wall_s}
        most = asdict(self)
        names = [n for n in ("wall_s", "motion_s", "energy_j") if used[n] > 0.0]
        room = [int((most[n] - used[n]) * rounds / used[n]) for n in names]
        return max(0, min([self.motions - motions, *room]))


def duration_s(text: str) -> float:
    """Seconds of a text such as `10min`, `90s` or `1h`.

    Raises:
        UsageError: another form, or no positive time.
    """
    found = re.fullmatch(r"(\d+(?:\.\d+)?)\s*(s|min|h)", text.strip())
    seconds = float(found[1]) * _UNITS_S[found[2]] if found else 0.0
    if seconds <= 0.0:
        raise UsageError(f"--budget is a time above zero such as 10min, 600s or 1h, not {text!r}.")
    return seconds


def limited(budget: Budget, assignments: list[str]) -> Budget:
    """The budget with some bounds changed, each written as NAME=VALUE.

    Raises:
        UsageError: no such bound, or no number above or equal to zero.
    """
    for text in assignments:
        name, _, value = text.partition("=")
        known = asdict(budget)
        try:
            number = type(known[name])(value)
        except (KeyError, ValueError) as error:
            valid = ", ".join(known)
            raise UsageError(f"--limit {text!r} is not NAME=NUMBER; names are {valid}.") from error
        if not number >= 0:
            raise UsageError(f"--limit {name} is {number:g}: give a number of at least 0.")
        budget = replace(budget, **{name: number})
    return budget


def cost_of(log: Path, transmission: Transmission, continuous_nm: tuple[float, ...]) -> Cost:
    """What a run has cost, from its log.

    Args:
        log: the log.
        transmission: of the arm.
        continuous_nm: torque that each motor stands for ever, shape (n,) [N m].

    Raises:
        DataError: the log cannot be read.
    """
    found = read_recording(log)
    t = (found.stamp_ns - found.stamp_ns[0]) * 1e-9
    if found.command is None or found.command.effort is None or len(t) < 2:
        return Cost(float(t[-1]) if len(t) else 0.0)
    tau = found.command.effort[: len(t)]
    dq = np.diff(found.q[: len(tau)], axis=0)
    motor = tau @ transmission.joint_from_motor
    load = np.sqrt(np.mean(motor**2, axis=0)) / np.array(continuous_nm)
    return Cost(float(t[-1]), float(np.abs(tau[1:] * dq).sum()), float(load.max()))
