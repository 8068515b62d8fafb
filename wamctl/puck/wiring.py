"""Who sends what to whom: groups, places in the torque frames, and the frames of the cycle."""

from dataclasses import dataclass

import can

from wamctl.arm.config import PuckDrivesSection
from wamctl.puck import frames
from wamctl.puck.enumerations import Group, MotorMode, SafetyMode
from wamctl.puck.properties import Properties

PUCKS_PER_TORQUE_FRAME = 4


def torque_group(slot: int) -> Group:
    """Group of the torque frame that carries the motor at a place (0, 1, ...) of the arm."""
    return Group.LOWER_TORQUES if slot < PUCKS_PER_TORQUE_FRAME else Group.UPPER_TORQUES


def torque_place(slot: int) -> int:
    """PIDX of that motor: its place in the torque frame, from 1."""
    return slot % PUCKS_PER_TORQUE_FRAME + 1


def memberships(slot: int) -> dict[str, int]:
    """GRPA, GRPB and GRPC of that motor (libbarrett and OWD; the 2008 manual has others)."""
    return {
        "GRPA": Group.ALL_ACTUATORS,
        "GRPB": torque_group(slot),
        "GRPC": Group.WHOLE_ARM,
    }


def position_reply(node: int) -> int:
    """Identifier of a Puck's positions."""
    return frames.to_group(Group.POSITION_FEEDBACK, node)


def position_length(joint_encoder_counts: int) -> int:
    """Data bytes of a Puck's positions, with or without a joint encoder."""
    return 6 if joint_encoder_counts else 3


def property_reply(node: int) -> int:
    """Identifier of a Puck's answers to all other questions."""
    return frames.to_group(Group.PROPERTY_FEEDBACK, node)


@dataclass(frozen=True)
class CycleFrames:
    """The frames of the cycle, made before it begins.

    Attributes:
        poll: asks all motors for their positions.
        to_idle: take all torque away, first from the Pucks, then through the safety module.
        slot_of: place of the motor whose positions have an identifier.
        lengths: data bytes of each motor's positions.
        node_of: node whose answers have an identifier.
        alarm_id: what the safety module sends by itself.
        torque_property: number of T.
    """

    poll: can.Message
    to_idle: tuple[can.Message, ...]
    slot_of: dict[int, int]
    lengths: tuple[int, ...]
    node_of: dict[int, int]
    alarm_id: int
    torque_property: int

    def torques(self, units: list[int]) -> list[can.Message]:
        """The torque frames for all motors, in Puck units."""
        size = PUCKS_PER_TORQUE_FRAME
        return [
            message(
                frames.to_group(torque_group(first)),
                frames.encode_torques(self.torque_property, units[first : first + size]),
            )
            for first in range(0, len(units), size)
        ]


def cycle_frames(drives: PuckDrivesSection, motor: Properties, safety: Properties) -> CycleFrames:
    """The cycle of an arm.

    Args:
        drives: the configuration.
        motor: properties of the motor Pucks' firmware.
        safety: properties of the safety module's firmware.
    """
    module = drives.safety_module.node_id
    idle = frames.encode_set(motor["MODE"], MotorMode.IDLE)
    lower = frames.encode_set(safety["MODE"], SafetyMode.IDLE)
    return CycleFrames(
        poll=message(frames.to_group(Group.WHOLE_ARM), frames.encode_get(motor["P"])),
        to_idle=(
            message(frames.to_group(Group.WHOLE_ARM), idle),
            message(frames.to_node(module), lower),
        ),
        slot_of={position_reply(node): slot for slot, node in enumerate(drives.node_ids)},
        lengths=tuple(position_length(counts) for counts in drives.joint_encoder_counts),
        node_of={property_reply(node): node for node in (*drives.node_ids, module)},
        alarm_id=frames.to_group(Group.ALL_ACTUATORS, module),
        torque_property=motor["T"],
    )


def message(identifier: int, data: bytes) -> can.Message:
    """A frame ready to be sent."""
    return can.Message(arbitration_id=identifier, is_extended_id=False, data=data)


def is_plain(frame: can.Message) -> bool:
    """A data frame with an 11-bit identifier: all that Pucks send."""
    return not (frame.is_extended_id or frame.is_remote_frame or frame.is_error_frame)
