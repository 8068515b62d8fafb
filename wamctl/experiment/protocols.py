"""Which master serves which protocol: the one place that knows all of them."""

from pathlib import Path

import can

from wamctl.arm.config import ArmFile, CanopenDrivesSection, beside
from wamctl.canopen import bus_load as canopen_load
from wamctl.canopen.master import CanopenDrives
from wamctl.drives.bus import Channel
from wamctl.drives.bus_load import Load
from wamctl.drives.interface import Drives
from wamctl.puck import bus_load as puck_load
from wamctl.puck.master import PuckDrives


def open_drives(
    bus: can.BusABC, channel: Channel, arm: ArmFile, path: Path, lockstep: bool
) -> Drives:
    """The motor controllers of a configuration on an open bus.

    Args:
        bus: the bus, which nobody else reads.
        channel: what to call it.
        arm: the configuration.
        path: its file, beside which other files are.
        lockstep: the arm is simulated, and its time stands still between cycles.
    """
    if isinstance(arm.drives, CanopenDrivesSection):
        dictionary = beside(path, arm.drives.dictionary)
        return CanopenDrives(bus, arm, arm.drives, dictionary, channel)
    return PuckDrives(bus, arm, arm.drives, channel, lockstep)


def bus_plan(arm: ArmFile) -> Load:
    """What the experiment puts on the bus."""
    if isinstance(arm.drives, CanopenDrivesSection):
        return canopen_load.plan(arm.bus, arm.drives)
    return puck_load.plan(arm.bus, arm.drives)
