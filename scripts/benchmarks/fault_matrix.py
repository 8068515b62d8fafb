# ruff: noqa: SLF001 - it lets faults begin in the middle of a run
"""How an experiment ends when something goes wrong: every fault in every phase.

Usage: scripts/benchmarks/fault_matrix.py PROTOCOL [SEEDS [FAULT...]] [OPTION...], from the root,
with .venv's Python; PROTOCOL is canopen or puck.

    --first N    the first seed; 0 without it
    --minutes N  no seed is begun that would not end by then

For each seed one short experiment with the test of the motors runs in lockstep, in one process. For
each fault and phase the process is forked, with the fault at a random drive and moment of that
phase. Times are simulated ones: the stop is detected at the SYNC (the poll) of the cycle in which
the master stops; torques and states of the drives are those that the simulated arm has.

A stop is defined if the exit code is 4 or 5 with one sentence, no torque of before acts for more
than two cycles from detection (then it is zero, or brakes), all drives are disabled within 100 ms
of detection and stay so, and every cycle up to the fault was logged. A host that is off the bus can
tell the drives nothing: there, their own watch ends the torque, and two cycles are not asked for.

A stuck encoder, or a motor without torque, shows only where the motor has to move: these two are
drawn where its reference has yet to go 1.25 times half its tracking limit in that phase, which is
how far the guard allows an encoder to stand still. For motors 5 to 7 without torque, which friction
would hold as well, it is 1.25 times the whole limit. In `enable` and `test` the way of the whole
run counts. On a classic arm, the module's fall to IDLE takes nothing away before Shift-Activate: in
`enable`, it is drawn behind that.
"""

import argparse
import math
import os
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from fault_verdict import Ending, judged
from fault_witness import Testimony, Witness
from numpy.typing import NDArray
from one_process import Branches, Rig, set_up

from sim_bus.faults.assembly import load_faulty_simulation
from sim_bus.faults.faulty_arm import FaultyArm
from sim_bus.faults.script import FaultScript
from wamctl.arm.config import find_file
from wamctl.arm.errors import UserError
from wamctl.arm.trajectory import FourierSeries, Reference, Trajectory, write_trajectory
from wamctl.experiment.preflight import Prepared, prepare
from wamctl.telemetry.status import Phase

PHASES = ("enable", "test", "move", "excite", "return")
WORDS = {
    Phase.ENABLE: "enable",
    Phase.TEST: "test",
    Phase.APPROACH: "move",
    Phase.EXCITE: "excite",
    Phase.RETURN: "return",
}
TEST_CYCLES = 2000  # of the test of the motors, which takes some more
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
MOST_TRIES = 5
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


@dataclass(frozen=True)
class Stage:
    """Moments at which faults may begin.

    Attributes:
        first: its first cycle, counted from that in which the stage begins.
        to_go: how far each motor has yet to go, in tracking limits, cycle by cycle from the first,
            shape (cycles, n).
    """

    first: int
    to_go: Array


def stages(rig: Rig) -> dict[str, Stage]:
    """The moments of each phase; `active` lies between Shift-Activate and the first motion."""
    parts = (rig.motion.approach, rig.motion.excitation, rig.motion.retreat)
    found = {
        name: Stage(10, left_to_go(rig.prepared, [part])[10:-100])
        for name, part in zip(PHASES[2:], parts, strict=True)
    }
    whole = left_to_go(rig.prepared, parts)[:1]
    for name, first, cycles in (("enable", 1, 4), ("active", 1, 2), ("test", 10, TEST_CYCLES)):
        found[name] = Stage(first, np.repeat(whole, cycles, axis=0))
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


def drawn(
    protocol: Protocol, name: str, stage: Stage, random: np.random.Generator
) -> tuple[int, Fault]:
    """A random moment of a stage, and a fault that begins then at a random drive."""
    cycle, motor = random.choice(np.argwhere(stage.to_go >= TO_GO.get(name, 0.0)))
    node, kind = int(motor) + 1, name.split()[0]
    place: Fault = {"node": node}
    if kind.endswith("_frames"):
        place = {"id": protocol.position_id[0] + (node - 1) * protocol.position_id[1]}
    elif kind in ("pendant", "safety_fault", "lost_zero"):
        place = {}
    return stage.first + int(cycle), {"fault": kind, **place, **protocol.faults[name], "cycles": 0}


Plan = dict[tuple[str, int], list[tuple[str, str, Fault]]]
"""By stage and its cycle: name, phase and words of the faults that begin then."""


def planned(rig: Rig, protocol: Protocol, names: Sequence[str], seed: int) -> Plan:
    """Every fault, once in every phase."""
    plan: Plan = defaultdict(list)
    moments = stages(rig)
    for name in names:
        for phase in PHASES:
            random = np.random.default_rng(
                [seed, list(protocol.faults).index(name), PHASES.index(phase)]
            )
            stage = "active" if phase == "enable" and name in NEEDS_TORQUE else phase
            cycle, fault = drawn(protocol, name, moments[stage], random)
            plan[stage, cycle].append((name, phase, fault))
    return plan


def endings(
    prepared: Prepared, config: Path, protocol: Protocol, names: Sequence[str], seed: int
) -> list[tuple[tuple[str, str], Ending]]:
    """One seed: how each fault ended in each phase."""
    said: list[str] = []
    nothing = config.with_name("faults.yaml")
    nothing.write_text(yaml.safe_dump({"faults": []}))
    simulation, arm = load_faulty_simulation(config, seed, nothing, said.append)
    simulation.arm.plant.warm_up()
    witness = Witness(arm, simulation)
    with Branches() as cases, set_up(prepared, config, simulation, witness) as rig:
        plan, passed, chosen = planned(rig, protocol, names, seed), Counter(), ["healthy"]

        def before_cycle() -> None:
            words = [WORDS.get(rig.loop.phase, "")] + ["active"] * simulation.arm.is_enabled
            for word in () if cases.is_case else words:
                passed[word] += 1
                for name, phase, fault in plan.get((word, passed[word]), ()):
                    if cases.branch((name, phase)):
                        let_begin(arm, fault)
                        chosen[0] = name
                        return

        rig.bus.before_cycle = before_cycle
        error: UserError | None = None
        try:
            rig.run()
        except UserError as raised:
            error = raised
        witness.stay_alone()
        seen = Testimony(tuple(said), witness.first_ns, tuple(witness.spans))
        cases.end(judged(error, seen, rig.log.stamps_ns, chosen[0] in UNHEARD))
        if error is not None:
            raise error
    return cases.results


def let_begin(arm: FaultyArm, fault: Fault) -> None:
    """A fault that begins with the next frame."""
    arm._timeline._waiting += FaultScript.model_validate({"faults": [fault]}).faults


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
    asked = parser.parse_args()
    protocol, began_s = PROTOCOLS[asked.protocol], time.monotonic()
    names = asked.faults or list(protocol.faults)
    found: dict[tuple[str, str], list[Ending]] = defaultdict(list)
    with tempfile.TemporaryDirectory() as box:
        config = configuration(Path(box), protocol.config)
        prepared = prepare(config)
        for done, seed in enumerate(range(asked.first, asked.first + asked.seeds), 1):
            for (name, phase), ending in endings(prepared, config, protocol, names, seed):
                found[name, phase].append(ending)
                if ending.missed:
                    why = f"{', '.join(ending.missed)}: {ending.sentence}"
                    print(f"{name} {phase} {seed}: {why}", file=sys.stderr)
            minutes, cpu_s = (time.monotonic() - began_s) / 60.0, sum(os.times()[:4])
            cases = done * len(names) * len(PHASES)
            print(f"{done} seeds, {minutes:.1f} min, {cpu_s / cases:.2f} s a case", file=sys.stderr)
            if minutes * (done + 1) / done > asked.minutes:
                break
    print(*table(found, names), sep="\n")


if __name__ == "__main__":
    main()
