"""Devices on the bus as the simulation sees them, and the frames that pace their cycle."""

from collections.abc import Container
from dataclasses import dataclass
from typing import Protocol

from sim_bus.can_bus.frame import Frame
from sim_bus.plant.encoders import Encoders


class Node(Protocol):
    """A device on the bus; times are arguments [ns]."""

    @property
    def handlers(self) -> Container[int]:
        """Identifiers of the frames that concern the node."""
        ...

    @property
    def next_ns(self) -> int:
        """When `tick` is due at the earliest."""
        ...

    def boot(self, time_ns: int) -> list[Frame]:
        """Power-on."""
        ...

    def receive(self, time_ns: int, frame: Frame) -> list[Frame]:
        """The answers to a frame."""
        ...

    def tick(self, time_ns: int) -> list[Frame]:
        """Frames that are due by a time without any input."""
        ...


class MotorNode(Node, Protocol):
    """A device on the bus that drives one motor."""

    @property
    def motor_torque_nm(self) -> float:
        """Torque that the motor makes [N m]."""
        ...

    @property
    def is_enabled(self) -> bool:
        """Whether the power stage drives the motor."""
        ...


@dataclass(frozen=True)
class SyncSchedule:
    """The frames that matter to virtual time.

    Attributes:
        opening_id: identifier of the frame that opens a cycle.
        opening_data: how its data begin.
        closing_id: identifier of the last torque frame, where torques act on arrival; None where
            all but those of a stop wait for the next opening frame.
        torque_ids: identifiers of all torque frames and commands.
        torques_after_ns: how long after the opening frame they arrive [ns].
        sets_up_by_time: the devices mind pauses before the first cycle, so that time must pass.
    """

    opening_id: int
    opening_data: bytes = b""
    closing_id: int | None = None
    torque_ids: frozenset[int] = frozenset()
    torques_after_ns: int = 0
    sets_up_by_time: bool = False

    def opens(self, frame: Frame) -> bool:
        """Whether a frame opens a cycle."""
        return frame.can_id == self.opening_id and frame.data.startswith(self.opening_data)


@dataclass(frozen=True)
class Devices:
    """All devices on the bus.

    Attributes:
        encoders: what the motors' devices read.
        motors: one device per motor.
        others: devices without a motor.
        schedule: the frames of their cycle.
    """

    encoders: Encoders
    motors: tuple[MotorNode, ...]
    others: tuple[Node, ...]
    schedule: SyncSchedule
