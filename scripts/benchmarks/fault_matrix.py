"""How an experiment ends when something goes wrong: every fault in every phase.

Usage: scripts/benchmarks/fault_matrix.py PROTOCOL [SEEDS [FAULT...]] [OPTION...], from the root,
with .venv's Python; PROTOCOL is canopen or puck.

    --first N    the first seed; 0 without it
    --minutes N  no seed is begun that would not end by then
    --jobs N     so many cases at a time; 1 without it

For each fault, phase and seed a short experiment runs in lockstep on the embedded bus, with the
fault at a random drive and moment of that phase. Times are simulated ones: the stop is detected at
the SYNC (the poll) of the cycle in which the master stops; torques and states of the drives are
those that the simulated arm has.

A stop is defined if the exit code is 4 or 5 with one sentence, no torque of before acts for more
than two cycles from detection (then it is zero, or brakes), all drives are disabled within 100 ms
of detection and stay so, and the log opens and holds every cycle up to the fault. A host that is
off the bus can tell the drives nothing: there, their own watch ends the torque, and two cycles are
not asked for.

A stuck encoder, or a motor without torque, shows only where the motor has to move: these two are
drawn where its reference has yet to go 1.25 times half its tracking limit in that phase, which is
how far the guard allows an encoder to stand still. For motors 5 to 7 without torque, which friction
would hold as well, it is 1.25 times the whole limit. On a classic arm, the module's fall to IDLE
takes nothing away before Shift-Activate: in `enable`, it is drawn behind that.

The set-up waits for answers in real time. Where a busy machine lets it fail before the fault has
begun, the run is repeated.
"""

import argparse
import functools
import io
import math
import multiprocessing
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import redirect_stderr, suppress
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
import yaml
from fault_verdict import PERIOD_S, Ending, TooBusyError, judged
from fault_witness import Case, served
from numpy.typing import NDArray

from sim_bus.assembly import load_simulation
from wamctl.arm.config import find_file
from wamctl.arm.errors import UserError
from wamctl.arm.motion import move
from wamctl.arm.trajectory import FourierSeries, Reference, Trajectory, write_trajectory
from wamctl.canopen import dictionary
from wamctl.experiment.excite import ExciteRequest, excite
from wamctl.experiment.preflight import Prepared, prepare
from wamctl.experiment.session import Setup

PHASES = ("enable", "move", "excite", "return")
POSE = np.array([0.0, -1.0, 0.0, 2.5, 0.0, 0.0, 0.0])
CENTRE = POSE + np.array([0.6, 0.4, 0.0, -0.6, -1.2, 0.0, 1.6])
SPEED = (0.6, -0.2, 1.0, -0.8, 1.6, -0.2, 1.8)
TO_GO = {  # for each motor, of its tracking limit
    "stuck_encoder": 1.25 * np.full(7, 0.5),
    "torque_not_applied": 1.25 * np.array([0.5, 0.5, 0.5, 0.5, 1.0, 1.0, 1.0]),
}
NEEDS_TORQUE = ("pendant idle", "safety_fault torque", "safety_fault velocity")
UNHEARD = ("bus_off",)
MANY = 100_000
MOST_TRIES = 50
Array = NDArray[np.floating]
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


@dataclass(frozen=True)
class Window:
    """The moments of a phase.

    Attributes:
        after: what its cycles count from.
        first: its first cycle.
        last: its last cycle.
        to_go: how far each motor has yet to go, in tracking limits, per cycle from the first to
            the last, shape (cycles, n).
    """

    after: str
    first: int
    last: int
    to_go: Array


def configuration(folder: Path, shipped: str) -> Path:
    """A shipped arm with an experiment of six seconds, in which every motor has a way to go."""
    content = yaml.safe_load(find_file(shipped).read_text())
    content["robot"]["urdf"] = str(find_file("wam7.urdf"))
    if "dictionary" in content["drives"]:
        content["drives"]["dictionary"] = str(find_file(content["drives"]["dictionary"]))
    content["excitation"] |= {"trajectory": "short.yaml", "ramp_s": 0.5}
    joints, speed = tuple(content["robot"]["joints"]), np.array(SPEED)[:, None]
    series = FourierSeries(joints, np.pi, speed, 0 * speed, CENTRE)
    write_trajectory(folder / "short.yaml", Trajectory(series, 1, {}, {}))
    path = folder / "arm.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


@functools.cache
def prepared_once(config: Path) -> Prepared:
    """The checked configuration, which processes inherit that are forked later."""
    return prepare(config)


@functools.cache
def windows(config: Path) -> dict[str, Window]:
    """The moments of each phase; `active` lies between Shift-Activate and the first motion."""
    prepared = prepared_once(config)
    limits, robot, motion = prepared.arm.file.limits, prepared.arm.robot, prepared.excitation
    there = move(robot, limits, POSE, motion.q[0], PERIOD_S)
    back = move(robot, limits, motion.q[-1], POSE, PERIOD_S)
    parts, start, found = (there, motion, back), 0, {}
    for name, part in zip(PHASES[1:], parts, strict=True):
        inner = slice(10, len(part.q) - 100)
        to_go = left_to_go(prepared, [part])[inner]
        found[name] = Window("enabled", start + inner.start, start + inner.stop - 1, to_go)
        start += len(part.q)
    whole = left_to_go(prepared, parts)[:1]
    found["enable"] = Window("first_cycle", 1, 4, np.repeat(whole, 4, axis=0))
    found["active"] = Window("enabled", 1, 2, np.repeat(whole, 2, axis=0))
    return found


def left_to_go(prepared: Prepared, parts: Sequence[Reference]) -> Array:
    """How far each motor has yet to go, in tracking limits at the motor, shape (cycles, n)."""
    joints = prepared.arm.transmission
    angle = np.array([joints.motor_angle(q) for part in parts for q in part.q])[::-1]
    highest, lowest = np.maximum.accumulate(angle), np.minimum.accumulate(angle)
    mixing = np.abs(joints.motor_from_joint)
    tracking = mixing * np.array(prepared.arm.file.safety.tracking_error_rad)
    limit = np.where(mixing > 0.0, tracking, np.inf).min(axis=1)
    return np.maximum(highest - angle, angle - lowest)[::-1] / limit


def run(config: Path, fault: Fault, seed: int) -> Ending:
    """One experiment with one fault."""
    with tempfile.TemporaryDirectory() as box:
        folder, error = Path(box), None
        case = Case(config, seed, folder / "faults.yaml", folder / "bus")
        case.faults.write_text(yaml.safe_dump({"faults": [fault]}))
        prepared, log = prepared_once(config), folder / "log.mcap"
        with served(case) as court:
            setup = Setup(config, prepared.arm, f"simbus:{case.socket}", lockstep=True)
            try:
                with redirect_stderr(io.StringIO()):
                    excite(ExciteRequest(prepared, setup, log, lambda _: None, tests_motors=False))
            except UserError as raised:
                error = raised
            testimony = court.hear()
        return judged(error, testimony, log, str(fault["fault"]) in UNHEARD)


def drawn(protocol: Protocol, name: str, window: Window, random: np.random.Generator) -> Fault:
    """A fault at a random drive and moment of a phase."""
    cycle, motor = random.choice(np.argwhere(window.to_go >= TO_GO.get(name, 0.0)))
    node, kind = int(motor) + 1, name.split()[0]
    place: Fault = {"node": node}
    if kind.endswith("_frames"):
        place = {"id": protocol.position_id[0] + (node - 1) * protocol.position_id[1]}
    elif kind in ("pendant", "safety_fault", "lost_zero"):
        place = {}
    when = {"after": window.after, "cycles": window.first + int(cycle)}
    return {"fault": kind, **place, **protocol.faults[name], **when}


def one(config: Path, protocol: str, name: str, phase: str, seed: int) -> Ending:
    """One case of the matrix."""
    known = PROTOCOLS[protocol]
    random = np.random.default_rng([seed, list(known.faults).index(name), PHASES.index(phase)])
    window = "active" if phase == "enable" and name in NEEDS_TORQUE else phase
    fault = drawn(known, name, windows(config)[window], random)
    for _ in range(MOST_TRIES):
        with suppress(TooBusyError):
            return run(config, fault, seed)
    raise TimeoutError(f"this machine is too busy: no set-up out of {MOST_TRIES} was in time")


def table(found: dict[tuple[str, str], list[Ending]], names: Sequence[str]) -> Iterator[str]:
    """The lines of a Markdown table, of the endings by fault and phase."""
    last = "longest to detection", "from it to zero or braking", "to all drives disabled"
    yield "| " + " | ".join(["fault", *PHASES, *last]) + " |"
    yield "| --- " * (len(PHASES) + 4) + "|"
    for name in names:
        cells = []
        for phase in PHASES:
            endings = found[name, phase]
            codes = "/".join(str(c) for c in sorted({e.code for e in endings}))
            cells.append(f"{sum(not e.missed for e in endings)} of {len(endings)}, exit {codes}")
        stops = [e.stop for phase in PHASES for e in found[name, phase] if e.stop]
        if stops:
            cells.append(f"{max(s.found_ms for s in stops):.0f} ms")
            cells.append(f"{max(s.cycles for s in stops):.2g} cycles")
            cells.append(f"{max(s.off_ms for s in stops):.0f} ms")
        yield f"| {name} | " + " | ".join(cells) + " |"


def main() -> None:
    """The table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("protocol", choices=PROTOCOLS)
    parser.add_argument("seeds", nargs="?", type=int, default=20)
    parser.add_argument("faults", nargs="*")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--minutes", type=float, default=math.inf)
    parser.add_argument("--jobs", type=int, default=1)
    asked = parser.parse_args()
    protocol, began_s = PROTOCOLS[asked.protocol], time.monotonic()
    names = asked.faults or list(protocol.faults)
    found: dict[tuple[str, str], list[Ending]] = defaultdict(list)
    fork = multiprocessing.get_context("fork")
    with tempfile.TemporaryDirectory() as box:
        config = configuration(Path(box), protocol.config)
        windows(config)
        dictionary.load_dictionary = functools.cache(
            dictionary.load_dictionary
        )  # once, not per run
        load_simulation(config, 0).arm.plant.warm_up()
        cases = list(product(names, PHASES))
        with ProcessPoolExecutor(asked.jobs, fork) as pool:
            for done, seed in enumerate(range(asked.first, asked.first + asked.seeds), 1):
                waiting = [pool.submit(one, config, asked.protocol, *c, seed) for c in cases]
                for (name, phase), ending in zip(cases, waiting, strict=True):
                    found[name, phase].append(ending.result())
                    if found[name, phase][-1].missed:
                        why = f"{', '.join(ending.result().missed)}: {ending.result().sentence}"
                        print(f"{name} {phase} {seed}: {why}", file=sys.stderr)
                minutes = (time.monotonic() - began_s) / 60.0
                print(f"{done} seeds in {minutes:.1f} min", file=sys.stderr, flush=True)
                if minutes * (done + 1) / done > asked.minutes:
                    break
    print(*table(found, names), sep="\n")


if __name__ == "__main__":
    main()
