"""From a fault file to an arm with faults."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from sim_bus.assembly import Simulation, load_simulation
from sim_bus.canopen.drive import CanopenDrive
from sim_bus.faults.drives import AffectedDrive
from sim_bus.faults.faulty_arm import FaultyArm
from sim_bus.faults.script import (
    Fault,
    FaultScript,
    OnFrames,
    OnlyCanopen,
    OnSafetyModule,
    RandomFaults,
    WrongNode,
    read_fault_script,
)
from sim_bus.puck.drive import PuckDrive
from wamctl.arm.config import validate
from wamctl.arm.errors import ConfigurationError

_SYNC, _GROUPS = 0x080, (0x200, 0x300)
_CODES = (0x2310, 0x2320, 0x3210, 0x4210, 0x4310, 0x7122, 0x7320, 0x8611)
_LASTING = ("under_voltage", "silent_drive", "dead_drive", "bus_off", "stuck_encoder")
_LONGEST_CYCLES = 100
_LATEST_MS = 10.0
_LARGEST_JUMP_COUNTS = 4000


def load_faulty_simulation(
    config: str | Path,
    seed: int,
    faults: Path,
    tell: Callable[[str], None],
    effects: Path | None = None,
) -> tuple[Simulation, FaultyArm]:
    """The simulated arm of a configuration file, and the same arm with the faults of a fault file.

    Args:
        config: the arm's file, or the name of a shipped one.
        seed: which arm, and which chance.
        faults: the fault file.
        tell: takes a sentence about each fault as it begins.
        effects: file of hidden effects that the arm carries.

    Raises:
        ConfigurationError: a file that cannot be used, a fault that this arm cannot have.
    """
    script = read_fault_script(faults)
    misnumbered = {f.node: f.becomes for f in script.faults if isinstance(f, WrongNode)}
    simulation = load_simulation(config, seed, effects, misnumbered)
    affected_drives = _affected_drives(simulation)
    _check(script, affected_drives, faults)
    drawn = drawn_faults(script.random, list(affected_drives), seed).faults if script.random else ()
    everything = (*script.faults, *drawn)
    arm = FaultyArm(simulation.arm, everything, affected_drives, simulation.schedule, seed, tell)
    return simulation, arm


def _affected_drives(simulation: Simulation) -> dict[int, AffectedDrive]:
    pairs = zip(simulation.node_ids, simulation.arm.motors, strict=True)
    return {
        node: AffectedDrive(simulation.arm, motor, drive)
        for motor, (node, drive) in enumerate(pairs)
        if isinstance(drive, CanopenDrive | PuckDrive)
    }


def _check(script: FaultScript, affected_drives: dict[int, AffectedDrive], faults: Path) -> None:
    wrong = [
        f"faults.{k}{w}" for k, f in enumerate(script.faults) if (w := _wrong(f, affected_drives))
    ]
    if wrong:
        raise ConfigurationError(faults, wrong)


def _wrong(fault: Fault, affected_drives: dict[int, AffectedDrive]) -> str:
    """Why a fault cannot happen to this arm; empty if it can."""
    pucks = any(isinstance(v.drive, PuckDrive) for v in affected_drives.values())
    if isinstance(fault, OnSafetyModule):
        return "" if pucks else f": {fault.fault} needs a classic arm with a safety module"
    if isinstance(fault, OnFrames) or fault.node == "host":
        return ""
    if fault.node not in affected_drives:
        known = ", ".join(str(node) for node in affected_drives)
        return f".node: no drive has node id {fault.node}; the drives are {known}"
    if pucks and isinstance(fault, OnlyCanopen):
        return f": {fault.fault} is a fault of CANopen drives, not of classic Pucks"
    return ""


def drawn_faults(settings: RandomFaults, nodes: Sequence[int], seed: int) -> FaultScript:
    """The faults that a seed gives, as a script.

    Args:
        settings: how many, which, and when.
        nodes: node ids of the drives.
        seed: of chance.
    """
    random = np.random.default_rng([seed, 0xFA])
    faults = [_drawn(settings, nodes, random) for _ in range(settings.number)]
    return validate(FaultScript, {"faults": faults}, "random faults")


def _drawn(
    settings: RandomFaults, nodes: Sequence[int], random: np.random.Generator
) -> dict[str, object]:
    kind = str(random.choice(settings.faults))
    node = int(random.choice(list(nodes)))
    fault: dict[str, object] = {
        "fault": kind,
        "after": settings.after,
        "cycles": int(random.integers(settings.from_cycle, settings.to_cycle, endpoint=True)),
    }
    if kind.endswith("_frames"):
        identifiers = [_SYNC, *_GROUPS, *(0x180 + n for n in nodes)]
        fault |= {"id": int(random.choice(identifiers)), "number": int(random.integers(1, 20))}
    else:
        fault["node"] = node
    if kind == "late_frames":
        fault["late_ms"] = float(random.uniform(0.1, _LATEST_MS))
    elif kind in ("drive_fault", "emergency"):
        fault["code"] = int(random.choice(_CODES))
    elif kind == "encoder_jump":
        fault["counts"] = int(random.integers(-_LARGEST_JUMP_COUNTS, _LARGEST_JUMP_COUNTS))
    elif kind in _LASTING:
        fault["for_cycles"] = int(random.integers(1, _LONGEST_CYCLES))
    return fault
