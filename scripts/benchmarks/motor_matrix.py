"""Motors with a wrong sign, scale or wiring, with a load, in every phase: how far does the arm get?

Usage: scripts/benchmarks/motor_matrix.py [--seeds N] [--loads KG...] [--faults F...]
       [--phases P...] [--verbose], from the root, with .venv's Python.

`--faults operator` is a healthy arm that the operator stops at seven moments of each phase. Without
`test` among the phases the motors are not tested, so that an arm with a load comes to move.

For each load and protocol one run is forked at the moments at which the faults begin. An arm whose
test of the motors ends with a stop (a load, say) has no later phases.

The simulated arm's physics (friction, links that differ from CAD, quantised encoders) behind drives
that do what they are told; torque acts at the next SYNC (CANopen, but for that of a stop) or on
arrival (classic Pucks, and that of a stop). A fault begins before the test of the motors, or at a
random moment of the approach, the excitation or the return. For each: in which phase the arm was
stopped, and the largest joint speed, tool speed and kinetic energy from the stop until the drives
are off, over those at the stop or over a twentieth of their limits, whichever is more; and the same
over what the same arm reaches if all torque is taken away at that stop, since an arm falls, too.
For those that grow by more than 1.2: how fast the tool became.
"""

import argparse
import copy
import os
import sys
import tempfile
from collections import Counter, defaultdict, deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
import pinocchio as pin
import yaml

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
from ideal_arm import PERIOD_S, REST, IdealDrives, ListLog
from one_process import Branches

from sim_bus.assembly import load_simulation
from sim_bus.plant.plant import Plant
from wamctl.arm.trajectory import FourierSeries, reference
from wamctl.drives.interface import Readings
from wamctl.errors import StopError
from wamctl.experiment import phases as experiment
from wamctl.experiment.loop import Arm, Loop
from wamctl.experiment.preflight import load_arm
from wamctl.realtime.clock import LockstepClock

PHASES = ("test", "move", "excite", "return")
FAULTS = ("reversed", "dead", "doubled", "swapped", "x0.7", "x1.4")
OPERATOR = "operator"
MOST = 1.2
FLOOR = 0.05
KEPT = 100  # cycles before the end that a stop may lie back
PERIOD_NS = round(PERIOD_S * 1e9)
ARRIVAL = 0.75
"""Share of the period after which torque arrives: 0.9 to 1.1 ms until the last of two torque frames
at 1 Mbit/s, and 0.3 ms for reading and computing."""


class SimulatedDrives(IdealDrives):
    """The simulated arm's physics behind ideal drives.

    Attributes:
        seen: joint speed, tool speed and kinetic energy of the true arm, cycle by cycle.
        before_cycle: called before each cycle.
    """

    def __init__(self, arm: Arm, seed: int, load_kg: float, at_once: bool) -> None:
        super().__init__(arm)
        self.delay_cycles = 0 if at_once else 1
        self._arriving = np.zeros(7)
        self._plant = _plant(seed, load_kg)
        self._truth = arm.robot.model
        self._count = 2.0 * np.pi / np.array(arm.file.drives.counts_per_revolution)
        self._tool = self._truth.getFrameId(arm.file.limits.tool_frame)
        self.seen: list[tuple[float, float, float]] = []
        self.before_cycle: Callable[[], None] = lambda: None
        self._past: deque[tuple[int, Plant, np.ndarray]] = deque(maxlen=KEPT)

    def sample(self, timing: object) -> Readings:
        """What the arm reads now, one period behind the last time."""
        self._advance(self.cycle - 1.0 + ARRIVAL, self._torque)
        self._advance(self.cycle, self._arriving)
        self._torque = self._arriving = self._next
        self._on = self._wanted and self.obeys
        if self._on and self._plant.is_held:
            self._plant.release()
        self.before_cycle()
        self._past.append((self.cycle, _copied(self._plant), self._torque.copy()))
        self.cycle += 1
        self.seen.append(self._speeds(self._plant))
        angle = self._arm.transmission.motor_angle(self._plant.q)
        readings = Readings(
            np.round(angle / self._count) * self._count, (), self._on, not self._on, None
        )
        return self.accident(self.cycle, readings)

    def send(self, tau_motor: np.ndarray, at_once: bool = False) -> np.ndarray:
        """Torques for the next instant, or from their arrival on."""
        super().send(tau_motor)
        if not at_once and self.delay_cycles:
            return tau_motor
        self._arriving = self._next
        return tau_motor if self.delay_cycles else self._mean()

    @property
    def is_on(self) -> bool:
        """Whether torque has acted since the last sample."""
        return self._on

    def cut_off(self) -> None:
        """No torque from its arrival on."""
        self._wanted = False
        self.send(np.zeros(7), at_once=True)

    def cut_off_at(self, place: int) -> np.ndarray:
        """What would have been seen from a cycle on, had it taken all torque away."""
        cycle, plant, torque = self._past[place - len(self.seen)]
        given = np.zeros(7) if plant.is_held else self.motors(torque)
        plant.advance(round((cycle + ARRIVAL) * PERIOD_NS), given, np.zeros(7))
        found = [self.seen[place]]
        for later in range(cycle + 1, cycle + len(self.seen) - place):
            plant.advance(later * PERIOD_NS, np.zeros(7), np.zeros(7))
            found.append(self._speeds(plant))
        return np.array(found)

    def _speeds(self, plant: Plant) -> tuple[float, float, float]:
        """Joint speed, tool speed and kinetic energy."""
        pin.computeAllTerms(self._truth, self._data, plant.q, plant.qd)
        frame = pin.getFrameVelocity(self._truth, self._data, self._tool, pin.LOCAL)
        tool = float(np.linalg.norm(frame.linear))
        return float(np.abs(plant.qd).max()), tool, float(self._data.kinetic_energy)

    def _mean(self) -> np.ndarray:
        return ARRIVAL * self._torque + (1.0 - ARRIVAL) * self._arriving

    def _advance(self, until_cycle: float, torque: np.ndarray) -> None:
        given = self.motors(torque) if self._on else np.zeros(7)
        self._plant.advance(round(until_cycle * PERIOD_NS), given, np.zeros(7))


def _copied(plant: Plant) -> Plant:
    """A plant that goes on by itself: its positions are views of its own motion again."""
    found = copy.deepcopy(plant)
    found.q, found.qd, *found._middle = found._motion  # noqa: SLF001
    return found


def _plant(seed: int, load_kg: float):
    with tempfile.TemporaryDirectory() as folder:
        effects = Path(folder) / "effects.yaml"
        hidden = [{"effect": "payload", "kg": load_kg}] if load_kg else []
        effects.write_text(yaml.safe_dump({"effects": hidden}))
        return load_simulation("wam7.yaml", seed, effects if hidden else None).arm.plant


def motors_of(fault: str, motor: int):
    """What the motors make of torques."""
    if fault == "swapped":
        order = np.arange(7)
        order[[motor, (motor + 1) % 7]] = order[[(motor + 1) % 7, motor]]
        return lambda tau: tau[order]
    scale = {"reversed": -1.0, "dead": 0.0, "doubled": 2.0, "healthy": 1.0, OPERATOR: 1.0}.get(
        fault
    )
    factors = np.ones(7)
    factors[motor] = float(fault[1:]) if scale is None else scale
    return lambda tau: factors * tau


@dataclass(frozen=True)
class Case:
    """A motor with a fault, and when."""

    fault: str
    motor: int
    phase: str
    seed: int
    load_kg: float
    at_once: bool

    def __str__(self) -> str:
        drives = "puck" if self.at_once else "canopen"
        return f"{self.fault} {self.phase} {self.load_kg:g} kg motor {self.motor + 1} {drives}"


@dataclass(frozen=True)
class Ending:
    """How it ended: largest joint speed, tool speed and energy up to the stop, and their growth.

    Attributes:
        over: their growth over that of the arm without torque.
        braked: to the end.
    """

    stopped_in: str
    most: np.ndarray
    growth: np.ndarray
    over: np.ndarray
    tool_m_s: float
    cause: str
    braked: bool


def motion_of(arm: Arm) -> experiment.Motion:
    """A short experiment in which every motor has a way to go."""
    ways = np.array([0.5, 0.3, 0.5, -0.4, 0.8, 0.4, 0.8])[:, None]
    series = FourierSeries(arm.robot.joint_names, np.pi, ways, 0.0 * ways, REST + 0.1)
    return experiment.plan(arm, REST, reference(series, 1, 0.5, PERIOD_S))


def endings(
    arm: Arm, seed: int, load_kg: float, at_once: bool, asked: argparse.Namespace
) -> list[tuple[Case, Ending]]:
    """All cases of an arm with a load: forks of one run, each from the moment of its fault."""
    drives = SimulatedDrives(arm, seed, load_kg, at_once)
    key: list[str] = []
    loop = Loop(arm, drives, LockstepClock(PERIOD_S), ListLog(), lambda: next(iter(key), None))
    motion = motion_of(arm)
    lengths = {
        "test": 0,
        "move": len(motion.approach.t),
        "excite": len(motion.excitation.t),
        "return": len(motion.retreat.t),
    }
    plan: dict[tuple[str, int], list[Case]] = defaultdict(list)
    for fault, phase, motor in product(asked.faults, asked.phases, range(7)):
        share = np.random.default_rng([seed, motor]).uniform(0.05, 0.7)
        case = Case(fault, motor, phase, seed, load_kg, at_once)
        plan[phase, 1 + round(share * lengths[phase])].append(case)
    passed: Counter[str] = Counter()
    with Branches() as cases:

        def before_cycle() -> None:
            word = {"approach": "move"}.get(loop.phase.word, loop.phase.word)
            passed[word] += 1
            for case in () if cases.is_case else plan.get((word, passed[word]), ()):
                if cases.branch(case):
                    drives.motors = motors_of(case.fault, case.motor)
                    key.extend(["a key"] * (case.fault == OPERATOR))
                    return

        drives.before_cycle = before_cycle
        cases.end(ended(arm, drives, loop, motion, "test" in asked.phases))
    return cases.results


def ended(
    arm: Arm, drives: SimulatedDrives, loop: Loop, motion: experiment.Motion, tests: bool
) -> Ending:
    """How an experiment ends."""
    try:
        experiment.run(arm, drives, loop, motion, tests_motors=tests)
    except StopError as stop:
        if drives.is_on:  # told to cut off at the very end: what the last torques have made of it
            drives.sample(None)
        seen, limits = np.array(drives.seen), arm.file.limits
        at = min(round(stop.at_s / PERIOD_S), len(seen) - 1)
        energy_j = limits.kinetic_energy_j or np.inf
        floor = FLOOR * np.array([max(limits.velocity_rad_s), limits.tool_speed_m_s, energy_j])
        after = seen[at:].max(axis=0)
        growth = after / np.maximum(seen[at], floor)
        over = after / np.maximum(drives.cut_off_at(at).max(axis=0), floor)
        return Ending(
            str(stop.phase),
            seen[: at + 1].max(axis=0),
            growth,
            over,
            after[1],
            stop.cause,
            "was braked" in stop.outcome,
        )
    return Ending(
        "", np.array(drives.seen).max(axis=0), np.ones(3), np.ones(3), 0.0, "", braked=False
    )


def rows(found: dict[tuple[str, str], list[Ending]]) -> Iterator[str]:
    """The lines of a Markdown table."""
    yield (
        "| fault | in | stopped | joint speed up to the stop | growth of joint speed, tool speed, "
        f"energy | all at most {MOST} | tools of the others | over cutting off at once |"
        f" all at most {MOST} | braked to the end |"
    )
    yield "| --- " * 10 + "|"
    for (fault, phase), endings in found.items():
        stopped = [e for e in endings if e.stopped_in]
        cells = [fault, phase, f"{len(stopped)} of {len(endings)}"]
        if stopped:
            growth = np.array([e.growth for e in stopped])
            holds = [bool(np.all(g <= MOST)) for g in growth]
            tools = [e.tool_m_s for e, held in zip(stopped, holds, strict=True) if not held]
            cells.append(f"{max(e.most[0] for e in stopped):.1f} rad/s")
            cells.append(", ".join(f"{g:.2f}" for g in growth.max(axis=0)))
            cells.append(f"{sum(holds)} of {len(stopped)}")
            cells.append(f"at most {max(tools):.2f} m/s" if tools else "")
            over = np.array([e.over for e in stopped])
            cells.append(", ".join(f"{g:.2f}" for g in over.max(axis=0)))
            cells.append(f"{sum(np.all(over <= MOST, axis=1))} of {len(stopped)}")
            cells.append(f"{sum(e.braked for e in stopped)} of {len(stopped)}")
        yield f"| {' | '.join(cells)} |"


def main() -> None:
    """The table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--loads", type=float, nargs="*", default=[0.0, 3.0, 6.0])
    parser.add_argument("--faults", nargs="*", default=list(FAULTS))
    parser.add_argument("--phases", nargs="*", default=list(PHASES))
    parser.add_argument("--verbose", action="store_true")
    asked = parser.parse_args()
    arm = load_arm("wam7.yaml")[1]
    found: dict[tuple[str, str], list[Ending]] = defaultdict(list)
    for seed, load, at_once in product(range(asked.seeds), asked.loads, range(2)):
        for case, ending in endings(arm, seed, load, bool(at_once), asked):
            found[case.fault, case.phase].append(ending)
            if asked.verbose:
                most, growth = ending.most.round(2), ending.growth.round(2)
                where = ending.stopped_in or "no stop"
                over = ending.over.round(2)
                print(f"{case}: {where}, {most}, {growth}, {over}, {ending.cause[:90]}", flush=True)
        print(f"{load:g} kg: {sum(os.times()[:4]):.0f} s of a core", file=sys.stderr, flush=True)
    print(*rows(found), sep="\n")


if __name__ == "__main__":
    main()
