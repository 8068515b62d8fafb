"""The fault file: what goes wrong, where, and when."""

from pathlib import Path
from typing import Annotated, Literal, get_args

from pydantic import Field, model_validator

from wamctl.arm.config import Section, read_yaml, validate

NodeId = Annotated[int, Field(ge=1, le=127)]
Word = Annotated[int, Field(ge=0, le=0xFFFF)]
Trigger = Literal["power_on", "first_cycle", "enabled"]


class Timed(Section):
    """When a fault begins and how long it lasts."""

    after: Trigger = Field(
        default="power_on",
        description="what the beginning counts from: power-on, the first SYNC, all drives enabled",
    )
    cycles: Annotated[int, Field(ge=0)] | None = Field(
        default=None, description="number of cycles after which it begins"
    )
    seconds: Annotated[float, Field(ge=0, allow_inf_nan=False)] | None = Field(
        default=None, description="begins so much later [s]"
    )

    @model_validator(mode="after")
    def _has_one_delay(self) -> "Timed":
        if self.cycles is not None and self.seconds is not None:
            raise ValueError("give cycles or seconds, not both")
        return self


class Lasting(Timed):
    """A fault with an end."""

    for_cycles: Annotated[int, Field(ge=1)] | None = Field(
        default=None, description="number of cycles that it lasts; neither given: it stays"
    )
    for_seconds: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = Field(
        default=None, description="time that it lasts [s]"
    )

    @model_validator(mode="after")
    def _has_one_length(self) -> "Lasting":
        if self.for_cycles is not None and self.for_seconds is not None:
            raise ValueError("give for_cycles or for_seconds, not both")
        return self


class DriveFault(Timed):
    """The drive goes to FAULT and says why."""

    fault: Literal["drive_fault"]
    node: NodeId
    code: Word = Field(default=0x2310, description="error code, as in 0x603F")


class Emergency(Timed):
    """The drive sends an emergency message and goes on."""

    fault: Literal["emergency"]
    node: NodeId
    code: Word = 0x4210


class UnderVoltage(Lasting):
    """The drive's supply sinks: fault 0x3220, not to be reset before it is back."""

    fault: Literal["under_voltage"]
    node: NodeId


class SilentDrive(Lasting):
    """The drive hears and obeys, but nothing comes from it."""

    fault: Literal["silent_drive"]
    node: NodeId


class DeadDrive(Lasting):
    """The drive has no power: no frames, no torque; at the end it boots."""

    fault: Literal["dead_drive"]
    node: NodeId


class BusOff(Lasting):
    """A CAN controller leaves the bus: a drive's, or the host's, which an error frame tells."""

    fault: Literal["bus_off"]
    node: NodeId | Literal["host"]


class EncoderJump(Timed):
    """The position reading jumps and stays shifted."""

    fault: Literal["encoder_jump"]
    node: NodeId
    counts: int = Field(default=1000, description="[counts]")


class StuckEncoder(Lasting):
    """The position reading stands still."""

    fault: Literal["stuck_encoder"]
    node: NodeId


class TorqueNotApplied(Lasting):
    """The motor makes only a share of its torque, and the drive does not notice."""

    fault: Literal["torque_not_applied"]
    node: NodeId
    share: Annotated[float, Field(ge=-2, le=2, allow_inf_nan=False)] = 0.0


class PendantPressed(Timed):
    """Somebody presses a button of a classic arm's pendant."""

    fault: Literal["pendant"]
    button: Literal["idle", "estop", "activate"]


class SafetyFault(Timed):
    """A classic arm's safety module finds a fault and falls back to IDLE."""

    fault: Literal["safety_fault"]
    light: Literal["velocity", "torque", "voltage", "heartbeat", "other"]


class LostZero(Timed):
    """A classic arm's safety module forgets that positions are defined."""

    fault: Literal["lost_zero"]


class WrongNode(Section):
    """The drive has another node id, from the start."""

    fault: Literal["wrong_node"]
    node: NodeId
    becomes: NodeId


class WrongIdentity(Section):
    """The drive shows another vendor and product in 0x1018, from the start."""

    fault: Literal["wrong_identity"]
    node: NodeId
    vendor: Annotated[int, Field(ge=0, le=0xFFFF_FFFF)] = 0x123
    product: Annotated[int, Field(ge=0, le=0xFFFF_FFFF)] = 0x4


class FrameFault(Timed):
    """Something happens to the next frames of one identifier."""

    id: Annotated[int, Field(ge=0, le=0x7FF, description="identifier of the frames")]
    number: Annotated[int, Field(ge=1)] = Field(default=1, description="number of frames")


class LostFrames(FrameFault):
    """The frames never arrive."""

    fault: Literal["lost_frames"]


class LateFrames(FrameFault):
    """The frames leave later."""

    fault: Literal["late_frames"]
    late_ms: Annotated[float, Field(gt=0, le=1000)]


class DoubledFrames(FrameFault):
    """The frames come twice."""

    fault: Literal["doubled_frames"]


class ReorderedFrames(FrameFault):
    """The frames come after one that they should precede."""

    fault: Literal["reordered_frames"]


class CorruptedFrames(FrameFault):
    """The frames' data have one wrong bit, or another length."""

    fault: Literal["corrupted_frames"]
    length: Annotated[int, Field(ge=0, le=8)] | None = Field(
        default=None, description="length that it is cut or filled to; not given: one wrong bit"
    )


Lasts = UnderVoltage | SilentDrive | DeadDrive | BusOff | StuckEncoder | TorqueNotApplied
OnDrive = DriveFault | Emergency | EncoderJump | Lasts
OnlyCanopen = DriveFault | Emergency | UnderVoltage | WrongIdentity
OnSafetyModule = PendantPressed | SafetyFault | LostZero
OnFrames = LostFrames | LateFrames | DoubledFrames | ReorderedFrames | CorruptedFrames
Happens = OnDrive | OnSafetyModule | OnFrames
AtStart = WrongNode | WrongIdentity
Fault = Annotated[Happens | AtStart, Field(discriminator="fault")]

Drawn = Literal[
    "drive_fault",
    "emergency",
    "under_voltage",
    "silent_drive",
    "dead_drive",
    "bus_off",
    "encoder_jump",
    "stuck_encoder",
    "torque_not_applied",
    "lost_frames",
    "late_frames",
    "doubled_frames",
    "reordered_frames",
    "corrupted_frames",
]
"""Faults that may be drawn at random: all but those of the start."""


class RandomFaults(Section):
    """Faults drawn from the seed."""

    number: Annotated[int, Field(ge=1, le=1000)] = 1
    faults: Annotated[tuple[Drawn, ...], Field(min_length=1)] = get_args(Drawn)
    after: Trigger = "enabled"
    from_cycle: Annotated[int, Field(ge=0, description="earliest beginning")] = 0
    to_cycle: Annotated[int, Field(ge=0, description="latest beginning")]

    @model_validator(mode="after")
    def _is_a_range(self) -> "RandomFaults":
        if self.to_cycle < self.from_cycle:
            raise ValueError(f"to_cycle {self.to_cycle} is before from_cycle {self.from_cycle}")
        return self


class FaultScript(Section):
    """A fault file."""

    faults: tuple[Fault, ...] = ()
    random: RandomFaults | None = None


def read_fault_script(path: Path) -> FaultScript:
    """The content of a fault file.

    Raises:
        ConfigurationError: unreadable, or all its faults at once.
    """
    return validate(FaultScript, read_yaml(path), path)
