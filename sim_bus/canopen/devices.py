"""The CANopen drives of an arm, from its file."""

from functools import partial
from pathlib import Path

import numpy as np

from sim_bus.canopen.dictionary import read_description
from sim_bus.canopen.drive import CanopenDrive, DriveSettings
from sim_bus.node import Devices, SyncSchedule
from sim_bus.plant.encoders import Encoders
from sim_bus.plant.plant import Plant
from sim_bus.plant.truth import Truth
from wamctl.arm.config import CanopenDrivesSection, beside

_SYNC = 0x080
_PDOS = frozenset(range(0x200, 0x580))  # of a master
_ARRIVAL_NS = 1_250_000  # seven answers, computing, two torque frames
_FIRST_SERIAL = 4000


def canopen_devices(
    drives: CanopenDrivesSection, config: Path, plant: Plant, truth: Truth, fd: bool
) -> Devices:
    """One CANopen drive per motor; with `fd` they speak CAN FD.

    Raises:
        ConfigurationError: the EDS file cannot be read.
    """
    counts_per_radian = np.array(drives.counts_per_revolution) / (2.0 * np.pi)
    encoders = Encoders(
        plant, counts_per_radian[:, None] * truth.motor_from_joint, np.array(drives.zero_counts)
    )
    description = read_description(beside(config, drives.dictionary))
    pairs = zip(drives.node_ids, drives.rated_torque_nm, strict=True)
    motors = [
        CanopenDrive(
            description.of_node(node_id),
            DriveSettings(node_id, round(rated * 1000.0), _FIRST_SERIAL + node_id, fd),
            partial(encoders.position, motor),
            partial(encoders.speed, motor),
        )
        for motor, (node_id, rated) in enumerate(pairs)
    ]
    schedule = SyncSchedule(_SYNC, torque_ids=_PDOS, torques_after_ns=_ARRIVAL_NS)
    return Devices(encoders, tuple(motors), (), schedule)
