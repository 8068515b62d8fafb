"""Faults of drives: how each begins and ends."""

from dataclasses import dataclass

from sim_bus.can_bus.frame import Frame
from sim_bus.canopen.drive import CanopenDrive
from sim_bus.canopen.emergency import ErrorCode
from sim_bus.faults.script import (
    BusOff,
    DeadDrive,
    DriveFault,
    Emergency,
    EncoderJump,
    Lasts,
    OnDrive,
    SilentDrive,
    StuckEncoder,
    TorqueNotApplied,
    UnderVoltage,
    WrongIdentity,
)
from sim_bus.puck.drive import PuckDrive
from sim_bus.simulated_arm import SimulatedArm


@dataclass(frozen=True)
class AffectedDrive:
    """The drive that a fault affects.

    Attributes:
        arm: the arm around it.
        motor: its place among the motors.
        drive: the drive.
    """

    arm: SimulatedArm
    motor: int
    drive: CanopenDrive | PuckDrive


def begin(fault: OnDrive, affected: AffectedDrive, time_ns: int) -> list[Frame]:
    """Apply a fault to a drive: the frames that it sends for it."""
    arm, drive = affected.arm, affected.drive
    match fault:
        case SilentDrive():
            arm.mute.add(drive)
        case DeadDrive():
            arm.mute.add(drive)
            arm.deaf.add(drive)
            _switch_off(drive)
        case BusOff():
            arm.mute.add(drive)
            arm.deaf.add(drive)
        case EncoderJump():
            arm.encoders.jump(affected.motor, fault.counts)
        case StuckEncoder():
            arm.encoders.freeze(affected.motor)
        case TorqueNotApplied():
            arm.weaken(affected.motor, fault.share)
        case _ if isinstance(drive, CanopenDrive):
            return _fail(fault, drive, time_ns)
    return []


def end(fault: Lasts, affected: AffectedDrive, time_ns: int) -> list[Frame]:
    """End a fault of a drive: the frames that it sends for it."""
    arm, drive = affected.arm, affected.drive
    arm.mute.discard(drive)
    arm.deaf.discard(drive)
    match fault:
        case StuckEncoder():
            arm.encoders.unfreeze(affected.motor)
        case TorqueNotApplied():
            arm.weaken(affected.motor, 1.0)
    if isinstance(drive, CanopenDrive):
        return _recover(fault, drive, time_ns)
    if isinstance(fault, DeadDrive):
        drive.switch_on()
    return []


def _fail(fault: OnDrive, drive: CanopenDrive, time_ns: int) -> list[Frame]:
    match fault:
        case DriveFault():
            return drive.fail(time_ns, fault.code)
        case Emergency():
            return drive.warn(time_ns, fault.code)
        case UnderVoltage():
            drive.motor.is_powered = False
            return drive.fail(time_ns, ErrorCode.UNDER_VOLTAGE)
    return []


def _recover(fault: Lasts, drive: CanopenDrive, time_ns: int) -> list[Frame]:
    match fault:
        case UnderVoltage():
            drive.motor.is_powered = True
        case DeadDrive():
            return drive.boot(time_ns)
        case BusOff():
            return drive.recover_from_bus_off(time_ns)
    return []


def _switch_off(drive: CanopenDrive | PuckDrive) -> None:
    if isinstance(drive, PuckDrive):
        drive.switch_off()
    else:
        drive.motor.reset()


def disguise(fault: WrongIdentity, drive: CanopenDrive | PuckDrive) -> None:
    """Give a CANopen drive another identity, which it keeps."""
    if isinstance(drive, PuckDrive):
        return
    drive.objects.fix((0x1018, 1), fault.vendor)
    drive.objects.fix((0x1018, 2), fault.product)
