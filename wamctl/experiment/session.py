"""From a word for a bus to drives that are set up on it, and back."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import can

from wamctl.drives.bus import EMBEDDED, Channel, SimulatedTime, open_bus, parse_channel
from wamctl.drives.interface import Drives
from wamctl.drives.one_master import check_silence, locked
from wamctl.errors import UsageError
from wamctl.experiment.loop import Arm
from wamctl.experiment.protocols import open_drives
from wamctl.experiment.simulator import simulated_arm
from wamctl.realtime.clock import Clock, LockstepClock, RealTimeClock


@dataclass(frozen=True)
class Setup:
    """Which arm, and where.

    Attributes:
        path: the arm's file.
        arm: its content and models.
        bus: `sim`, or INTERFACE:CHANNEL.
        lockstep: simulated time instead of real time.
        seed: of the simulated arm.
        hidden: effects that the simulated arm carries in secret: a shipped name or a file.
    """

    path: Path
    arm: Arm
    bus: str
    lockstep: bool = False
    seed: int = 0
    hidden: str | None = None

    @property
    def is_embedded(self) -> bool:
        """Whether we start the simulated arm ourselves."""
        return self.bus == EMBEDDED


@dataclass(frozen=True)
class Connection:
    """Drives that are identified and configured, and give no torque.

    Attributes:
        channel: the bus.
        clock: what paces the loop on it.
        drives: its drives.
        notes: what the operator should know.
        bus: the open bus.
    """

    channel: Channel
    clock: Clock
    drives: Drives
    notes: tuple[str, ...]
    bus: can.BusABC


@contextmanager
def connected(setup: Setup, zeroed: bool = True) -> Iterator[Connection]:
    """The drives of an arm; they are cut off when the block is left.

    Args:
        setup: which arm.
        zeroed: refuse an arm that does not know its zero.

    Raises:
        UserError: no such bus, no answer, or not the drives of the configuration.
    """
    with (
        _channel(setup) as channel,
        open_bus(channel, setup.arm.file.bus, setup.lockstep) as bus,
    ):
        drives = open_drives(bus, channel, setup.arm.file, setup.path, setup.lockstep)
        if not setup.is_embedded:
            check_silence(bus, channel, drives.is_own)
        notes = drives.set_up() if zeroed else drives.prepare()
        try:
            yield Connection(channel, _clock(setup, channel, bus), drives, tuple(notes), bus)
        finally:
            drives.cut_off()


def _clock(setup: Setup, channel: Channel, bus: can.BusABC) -> Clock:
    file = setup.arm.file
    if setup.lockstep:
        return LockstepClock(file.bus.period_s, bus if isinstance(bus, SimulatedTime) else None)
    overtime = file.safety.missed_cycles / 2
    return RealTimeClock(file.bus.period_s, channel.stamps_by_wall_clock, overtime)


@contextmanager
def _channel(setup: Setup) -> Iterator[Channel]:
    if setup.is_embedded:
        with simulated_arm(setup.path, setup.seed, setup.lockstep, setup.hidden) as channel:
            yield channel
        return
    channel = parse_channel(setup.bus)
    if setup.hidden is not None:
        raise UsageError(
            f"--hidden is for the embedded simulated arm: give --bus sim with it, not {channel}; "
            "no drive was asked."
        )
    if setup.lockstep and not channel.may_lockstep:
        raise UsageError(
            f"--lockstep is for simulated arms: on bus {channel} a SYNC would follow the last one "
            "at once."
        )
    with locked(channel):
        yield channel
