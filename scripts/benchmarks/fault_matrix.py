"""How an experiment ends when something goes wrong: every fault in every phase.

Usage: scripts/benchmarks/fault_matrix.py PROTOCOL [SEEDS [FAULT...]] [OPTION...], from the root,
with .venv's Python; PROTOCOL is canopen or puck.

    --first N    the first seed; 0 without it
    --minutes N  no seed is begun that would not end by then

For each fault, phase and seed a short experiment runs in lockstep on the embedded bus, with the
fault at a random drive and moment of that phase. Prints a table: how many of the seeds ended in a
defined stop (exit code 4 or 5 with its sentence, no torque and drives disabled, a log with every
row up to the fault), the codes, and the longest time from the fault to the last torque.
"""

import argparse
import math
import os
import re
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
import yaml

from sim_bus.assembly import Simulation
from sim_bus.faults.assembly import load_faulty_simulation
from sim_bus.hub import SocketHub
from sim_bus.server import Arm, Lockstep, serve
from wamctl.arm.config import find_file
from wamctl.arm.errors import UserError
from wamctl.arm.motion import move
from wamctl.arm.recording import read_recording
from wamctl.arm.trajectory import FourierSeries, Trajectory, write_trajectory
from wamctl.runtime.excite import Order, excite
from wamctl.runtime.preflight import Prepared, prepare
from wamctl.runtime.session import Place

PERIOD_S = 0.002
PHASES = ("enable", "move", "excite", "return")
POSE = np.array([0.0, -1.0, 0.0, 2.5, 0.0, 0.0, 0.0])
SPEED = (0.6, -0.6, 0.8, -0.8, 1.6, -0.7, 1.8)
MANY = 100_000
Fault = dict[str, object]
EITHER: dict[str, Fault] = {
    "silent_drive": {},
    "dead_drive": {},
    "bus_off": {"node": "host"},
    "encoder_jump": {"counts": 1000},
    "stuck_encoder": {},
    "torque_not_applied": {"share": 0.0},
    "lost_frames": {"number": MANY},
    "late_frames": {"number": MANY, "late_ms": 3.0},
    "doubled_frames": {"number": MANY},
    "reordered_frames": {"number": MANY},
}


@dataclass(frozen=True)
class Protocol:
    """What differs between the two kinds of drives.

    Attributes:
        config: the shipped arm.
        position_id: identifier of the first node's position, and its step from node to node.
        faults: by the words of the table, what the fault file says of them.
    """

    config: str
    position_id: tuple[int, int]
    faults: dict[str, Fault]


PROTOCOLS = {
    "canopen": Protocol(
        "wam7.yaml",
        (0x181, 1),
        {
            "drive_fault": {"code": 0x2310},
            "emergency": {"code": 0x4210},
            "under_voltage": {},
            **EITHER,
            "corrupted_frames": {"number": MANY, "length": 3},
        },
    ),
    "puck": Protocol(
        "wam7-classic.yaml",
        (0x423, 0x20),
        {
            "pendant idle": {"button": "idle"},
            "pendant estop": {"button": "estop"},
            "safety_fault torque": {"light": "torque"},
            "safety_fault velocity": {"light": "velocity"},
            "lost_zero": {},
            **EITHER,
            "corrupted_frames": {"number": MANY, "length": 2},
        },
    ),
}


class Witness:
    """An arm that remembers how far it has gone, and when its drives gave torque last [ns]."""

    def __init__(self, arm: Arm, simulation: Simulation) -> None:
        self.now_ns = self.last_torque_ns = 0
        self._arm, self.drives = arm, simulation.arm.motors
        self.boot, self.tick = arm.boot, arm.tick
        self.receive, self.overhear = arm.receive, arm.overhear

    @property
    def next_ns(self) -> int:
        """When `tick` is due."""
        return self._arm.next_ns

    def run_physics(self, time_ns: int) -> None:
        """Pass time on."""
        self.now_ns = time_ns
        if any(d.motor_torque_nm for d in self.drives):
            self.last_torque_ns = time_ns
        self._arm.run_physics(time_ns)

    def stay_alone(self) -> None:
        """A fifth of a second without a program, which lockstep would not let pass."""
        for _ in range(100):
            now_ns = self.now_ns + round(PERIOD_S * 1e9)
            for frame in self.tick(now_ns):
                self.overhear(now_ns, frame)
            self.run_physics(now_ns)


@dataclass(frozen=True)
class Ending:
    """How a run ended.

    Attributes:
        code: exit code; 0 when it went on to its end.
        defined: sentence, no torque, drives disabled, and a log that holds what came before.
        torque_s: from the fault to the last torque [s]; NaN when it went on to its end.
        sentence: what was said.
    """

    code: int
    defined: bool
    torque_s: float
    sentence: str


def configuration(folder: Path, shipped: str) -> Path:
    """A shipped arm with an experiment of three seconds."""
    content = yaml.safe_load(find_file(shipped).read_text())
    content["robot"]["urdf"] = str(find_file("wam7.urdf"))
    if "dictionary" in content["drives"]:
        content["drives"]["dictionary"] = str(find_file(content["drives"]["dictionary"]))
    content["excitation"] |= {"trajectory": "short.yaml", "ramp_s": 0.5}
    joints, speed = tuple(content["robot"]["joints"]), np.array(SPEED)[:, None]
    series = FourierSeries(joints, np.pi, speed, 0 * speed, POSE + 0.05)
    write_trajectory(folder / "short.yaml", Trajectory(series, 1, {}, {}))
    path = folder / "arm.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def windows(prepared: Prepared) -> dict[str, tuple[str, int, int]]:
    """Per phase: what its cycles count from, its first and its last cycle."""
    limits, robot = prepared.arm.file.limits, prepared.arm.robot
    motion = prepared.excitation
    there = len(move(robot, limits, POSE, motion.q[0], PERIOD_S).q)
    back = len(move(robot, limits, motion.q[-1], POSE, PERIOD_S).q)
    ends = np.cumsum([there, len(motion.q), back])
    return {
        "enable": ("first_cycle", 1, 4),
        "move": ("enabled", 10, int(ends[0]) - 100),
        "excite": ("enabled", int(ends[0]) + 10, int(ends[1]) - 100),
        "return": ("enabled", int(ends[1]) + 10, int(ends[2]) - 100),
    }


@contextmanager
def serving(arm: Arm, simulation: Simulation, path: Path) -> Iterator[None]:
    """A thread that serves the arm."""
    hub = SocketHub(path)
    reading, writing = os.pipe()
    service = Lockstep(arm, hub, simulation.period_ns, simulation.rhythm)
    with os.fdopen(reading) as stop:
        thread = threading.Thread(target=serve, args=(service, hub, stop))
        thread.start()
        try:
            yield
        finally:
            os.close(writing)
            thread.join()
            hub.close()


def run(config: Path, fault: Fault, seed: int, folder: Path) -> Ending:
    """One experiment with one fault."""
    script, log, socket = folder / "faults.yaml", folder / "log.mcap", folder / "bus"
    script.write_text(yaml.safe_dump({"faults": [fault]}))
    said: list[str] = []
    simulation, arm = load_faulty_simulation(config, seed, script, said.append)
    simulation.arm.plant.rehearse()
    witness, prepared, error = Witness(arm, simulation), prepare(config), None
    with serving(witness, simulation, socket):
        place = Place(prepared.path, prepared.arm, f"simbus:{socket}", lockstep=True)
        try:
            excite(Order(prepared, place, log, lambda _: None))
        except UserError as raised:
            error = raised
        witness.stay_alone()
    if error is None:
        return Ending(0, False, np.nan, "; ".join(said) or "the fault never began")
    began_s = float(re.search(r" begins at ([0-9.]+) s", said[0])[1]) if said else np.nan
    torque_s = max(0.0, witness.last_torque_ns * 1e-9 - began_s)
    off = not any(d.motor_torque_nm or d.is_enabled for d in witness.drives)
    rows = len(read_recording(log).q) if log.exists() else 0
    whole = rows >= int(fault.get("cycles", 0)) if fault["after"] == "enabled" else True
    return Ending(error.exit_code, bool(said) and off and whole, torque_s, str(error))


def drawn(
    protocol: Protocol, name: str, phase: tuple[str, int, int], random: np.random.Generator
) -> Fault:
    """A fault at a random drive and moment of a phase."""
    after, first, last = phase
    node = int(random.integers(1, 8))
    kind = name.split()[0]
    place: Fault = {"node": node}
    if kind.endswith("_frames"):
        place = {"id": protocol.position_id[0] + (node - 1) * protocol.position_id[1]}
    elif kind in ("pendant", "safety_fault", "lost_zero"):
        place = {}
    when = {"after": after, "cycles": int(random.integers(first, last + 1))}
    return {"fault": kind, **place, **protocol.faults[name], **when}


def table(found: dict[tuple[str, str], list[Ending]], names: Sequence[str]) -> Iterator[str]:
    """The lines of a Markdown table, of the endings by fault and phase."""
    yield "| fault | " + " | ".join(PHASES) + " | longest to the last torque |"
    yield "| --- " * (len(PHASES) + 2) + "|"
    for name in names:
        cells, longest = [], 0.0
        for phase in PHASES:
            endings = found[name, phase]
            codes = "/".join(str(c) for c in sorted({e.code for e in endings}))
            defined = sum(e.defined for e in endings)
            cells.append(f"{defined} of {len(endings)}, exit {codes}")
            longest = max([longest, *(e.torque_s for e in endings if e.code)])
        yield f"| {name} | " + " | ".join(cells) + f" | {1e3 * longest:.0f} ms |"


def main() -> None:
    """The table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("protocol", choices=PROTOCOLS)
    parser.add_argument("seeds", nargs="?", type=int, default=20)
    parser.add_argument("faults", nargs="*")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--minutes", type=float, default=math.inf)
    asked = parser.parse_args()
    protocol, began_s = PROTOCOLS[asked.protocol], time.monotonic()
    names = asked.faults or list(protocol.faults)
    found: dict[tuple[str, str], list[Ending]] = defaultdict(list)
    with tempfile.TemporaryDirectory() as box:
        config = configuration(Path(box), protocol.config)
        phases = windows(prepare(config))
        for done, seed in enumerate(range(asked.first, asked.first + asked.seeds), 1):
            for name, phase in product(names, PHASES):
                random = np.random.default_rng([seed, list(protocol.faults).index(name)])
                with tempfile.TemporaryDirectory() as folder:
                    fault = drawn(protocol, name, phases[phase], random)
                    ending = run(config, fault, seed, Path(folder))
                found[name, phase].append(ending)
                if not ending.defined:
                    print(f"{name} {phase} {seed}: {ending.sentence}", file=sys.stderr)
            minutes = (time.monotonic() - began_s) / 60.0
            print(f"{done} seeds in {minutes:.1f} min", file=sys.stderr, flush=True)
            if minutes * (done + 1) / done > asked.minutes:
                break
    print(*table(found, names), sep="\n")


if __name__ == "__main__":
    main()
