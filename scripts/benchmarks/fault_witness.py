"""What the simulated arm itself says of a stop: it is served in a process of its own."""

import multiprocessing
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import IO

import numpy as np

from sim_bus.assembly import Simulation
from sim_bus.can_bus.frame import Frame
from sim_bus.can_bus.socket_hub import SocketHub
from sim_bus.faults.assembly import load_faulty_simulation
from sim_bus.server import Arm, Lockstep, serve

ALONE_S = 0.2
_FORK = multiprocessing.get_context("fork")


@dataclass(frozen=True)
class Span:
    """A stretch of simulated time without a change.

    Attributes:
        until_ns: its end.
        torques: of the motors, as their drives make it [N m].
        enabled: how many drives are enabled.
        speed: of the fastest joint at the end [rad/s].
    """

    until_ns: int
    torques: tuple[float, ...]
    enabled: int
    speed: float


@dataclass(frozen=True)
class Testimony:
    """What has happened to the arm.

    Attributes:
        said: a sentence for each fault that has begun.
        first_ns: time of the first frame that opened a cycle.
        spans: one after the other, from power-on to a fifth of a second after the program.
    """

    said: tuple[str, ...]
    first_ns: int
    spans: tuple[Span, ...]


class Witness:
    """An arm that remembers what its drives did."""

    def __init__(self, arm: Arm, simulation: Simulation) -> None:
        self.first_ns = 0
        self.spans: list[Span] = []
        self._arm, self._simulation = arm, simulation
        self.boot, self.tick, self.overhear = arm.boot, arm.tick, arm.overhear

    @property
    def next_ns(self) -> int:
        """When `tick` is due."""
        return self._arm.next_ns

    def receive(self, time_ns: int, frame: Frame) -> list[Frame]:
        """A frame of the program."""
        if not self.first_ns and self._simulation.schedule.opens(frame):
            self.first_ns = time_ns
        return self._arm.receive(time_ns, frame)

    def run_physics(self, time_ns: int) -> None:
        """Pass time on."""
        arm = self._simulation.arm
        torques = tuple(motor.motor_torque_nm for motor in arm.motors)
        enabled = sum(motor.is_enabled for motor in arm.motors)
        self._arm.run_physics(time_ns)
        self.spans.append(Span(time_ns, torques, enabled, float(np.abs(arm.plant.qd).max())))

    def stay_alone(self) -> None:
        """A fifth of a second without a program, which lockstep would not let pass."""
        period_ns = self._simulation.period_ns
        now_ns = self.spans[-1].until_ns if self.spans else 0
        for _ in range(round(ALONE_S * 1e9) // period_ns):
            now_ns += period_ns
            for frame in self.tick(now_ns):
                self.overhear(now_ns, frame)
            self.run_physics(now_ns)


@dataclass(frozen=True)
class Case:
    """A simulated arm to be served.

    Attributes:
        config: the arm's file.
        seed: which arm.
        faults: the fault file.
        socket: where.
        effects: file of the hidden effects that it carries.
    """

    config: Path
    seed: int
    faults: Path
    socket: Path
    effects: Path | None = None


class Court:
    """The other end of a served arm's pipes.

    Args:
        answers: where its testimony comes from.
        stop: to be closed when it is to stop.
    """

    def __init__(self, answers: Connection, stop: IO[str]) -> None:
        self._answers, self._stop = answers, stop

    def hear(self) -> Testimony:
        """Stop serving, leave the arm alone for a while, and hear what has happened to it."""
        self._stop.close()
        return self._answers.recv()


@contextmanager
def served(case: Case) -> Iterator[Court]:
    """An arm in lockstep, in a process of its own; `hear` is to be called in the block."""
    answers, telling = _FORK.Pipe(duplex=False)
    reading, writing = os.pipe()
    process = _FORK.Process(target=_serve, args=(case, telling, reading, writing))
    process.start()
    telling.close()
    os.close(reading)
    with answers, os.fdopen(writing, "w") as stop:
        answers.recv()
        yield Court(answers, stop)
    process.join()


def _serve(case: Case, telling: Connection, reading: int, writing: int) -> None:
    os.close(writing)
    said: list[str] = []
    simulation, arm = load_faulty_simulation(
        case.config, case.seed, case.faults, said.append, case.effects
    )
    simulation.arm.plant.warm_up()
    witness, hub = Witness(arm, simulation), SocketHub(case.socket)
    telling.send("ready")
    with os.fdopen(reading) as stop:
        serve(Lockstep(witness, hub, simulation.period_ns, simulation.schedule), hub, stop)
    hub.close()
    witness.stay_alone()
    telling.send(Testimony(tuple(said), witness.first_ns, tuple(witness.spans)))
