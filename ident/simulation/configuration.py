"""Controller and drives as an arm's file names them."""

import numpy as np

from ident.dynamics.compiled_chain import chain_of
from ident.simulation.loop import Controller, Wire
from wamctl.arm.config import ArmFile, PuckDrivesSection
from wamctl.arm.robot import Robot, cad_parameters

_PER_MILLE = 1e-3


def controller_for(file: ArmFile, robot: Robot) -> Controller:
    """The controller of a configuration, with the CAD model."""
    section = file.controller
    bandwidth = np.array(section.bandwidth_rad_s)
    return Controller(
        chain_of(robot),
        cad_parameters(robot),
        bandwidth**2,
        2.0 * section.damping_ratio * bandwidth,
        section.velocity_cutoff_hz,
    )


def wire_for(file: ArmFile) -> Wire:
    """Encoders and drives of a configuration."""
    drives = file.drives
    if isinstance(drives, PuckDrivesSection):
        step_nm = 1.0 / np.array(drives.torque_units_per_nm)
    else:
        step_nm = _PER_MILLE * np.array(drives.rated_torque_nm)
    return Wire(
        np.array(file.transmission.motor_from_joint),
        np.array(drives.counts_per_revolution, dtype=float),
        step_nm,
        file.bus.period_s,
    )
