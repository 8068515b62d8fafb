"""The devices of a classic arm, from its file: motor Pucks and safety module."""

from functools import partial
from pathlib import Path

import numpy as np

from sim_bus.node import Devices, SyncSchedule
from sim_bus.plant.encoders import Encoders
from sim_bus.plant.plant import Plant
from sim_bus.plant.truth import Truth
from sim_bus.puck.drive import PuckDrive, PuckFacts
from sim_bus.puck.firmware import motor_ids
from sim_bus.puck.safety_module import SafetyFacts, SafetyModule
from sim_bus.puck.safety_node import SafetyNode
from wamctl.arm.config import PuckDrivesSection
from wamctl.arm.errors import ConfigurationError

_POLL = 0x404
_LOWER_TORQUES, _UPPER_TORQUES = 0x401, 0x402
_LOWER_ARM = 4  # motors in the lower torque frame
_TORQUES_AFTER_NS = 850_000
"""From a poll to the last torque frame, without time to compute (manual, p. 46)."""


def classic_devices(drives: PuckDrivesSection, config: Path, plant: Plant, truth: Truth) -> Devices:
    """Seven motor Pucks that have been zeroed, and their safety module in IDLE.

    Raises:
        ConfigurationError: Pucks with different firmware, for which no single poll would do.
    """
    if len({motor_ids(version)["P"] for version in drives.firmware}) > 1:
        raise ConfigurationError(
            config, [f"drives.firmware: {drives.firmware} number P differently in one arm"]
        )
    counts_per_radian = np.array(drives.counts_per_revolution) / (2.0 * np.pi)
    encoders = Encoders(
        plant, counts_per_radian[:, None] * truth.motor_from_joint, np.zeros(len(drives.node_ids))
    )
    motors = tuple(
        PuckDrive(
            PuckFacts(
                node,
                drives.firmware[motor],
                drives.poles[motor],
                drives.counts_per_revolution[motor],
                drives.torque_units_per_nm[motor],
            ),
            partial(encoders.position, motor),
            _joint_encoder(plant, motor, drives.joint_encoder_counts[motor]),
        )
        for motor, node in enumerate(drives.node_ids)
    )
    facts = SafetyFacts(
        drives.safety_module.node_id,
        drives.safety_module.firmware,
        drives.firmware[0],
        drives.node_ids,
        1.0 / counts_per_radian,
        np.linalg.inv(truth.motor_from_joint),
    )
    safety = SafetyNode(SafetyModule(facts, zeroed=True), motors)
    return Devices(encoders, motors, (safety,), _schedule(drives))


def _schedule(drives: PuckDrivesSection) -> SyncSchedule:
    has_upper = len(drives.node_ids) > _LOWER_ARM
    return SyncSchedule(
        opening_id=_POLL,
        opening_data=bytes([motor_ids(drives.firmware[0])["P"]]),
        closing_id=_UPPER_TORQUES if has_upper else _LOWER_TORQUES,
        torque_ids=frozenset({_LOWER_TORQUES, _UPPER_TORQUES}),
        torques_after_ns=_TORQUES_AFTER_NS,
        sets_up_by_time=True,
    )


def _joint_encoder(plant: Plant, joint: int, counts: int) -> partial[int] | None:
    """Reading of a joint's own encoder [counts]; None where there is none."""
    return partial(_read_joint, plant, joint, counts / (2.0 * np.pi)) if counts else None


def _read_joint(plant: Plant, joint: int, counts_per_radian: float) -> int:
    return round(float(plant.q[joint]) * counts_per_radian)
