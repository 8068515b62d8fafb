"""From a fault file to an arm with faults."""

from collections.abc import Callable
from pathlib import Path

from sim_bus.assembly import Simulation, load_simulation
from sim_bus.canopen.drive import CanopenDrive
from sim_bus.faults.draw import drawn_faults
from sim_bus.faults.drives import AffectedDrive
from sim_bus.faults.faulty_arm import FaultyArm
from sim_bus.faults.script import (
    Fault,
    FaultScript,
    OnFrames,
    OnlyCanopen,
    OnSafetyModule,
    WrongNode,
    read_fault_script,
)
from sim_bus.puck.drive import PuckDrive
from wamctl.arm.errors import ConfigurationError


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
