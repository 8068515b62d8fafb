"""What the experiment puts on the bus of a classic arm."""

from wamctl.arm.config import BusSection, PuckDrivesSection
from wamctl.drives.bus_load import Load, Traffic, load
from wamctl.puck.supervision import STEADY_CYCLES
from wamctl.puck.wiring import PUCKS_PER_TORQUE_FRAME, position_length

_ANSWER_BYTES = 6  # the longest


def plan(bus: BusSection, drives: PuckDrivesSection) -> Load:
    """Poll, positions and torques of every cycle, and now and then a question."""
    rate, n = 1.0 / bus.period_s, len(drives.node_ids)
    positions = [Traffic("position", rate, position_length(c)) for c in drives.joint_encoder_counts]
    return load(
        bus,
        [Traffic("poll", rate, 1), *positions],
        [Traffic("torque", rate, 8)] * -(-n // PUCKS_PER_TORQUE_FRAME),
        [
            Traffic("question", rate / STEADY_CYCLES, 1),
            Traffic("answer", rate / STEADY_CYCLES, _ANSWER_BYTES),
        ],
    )
