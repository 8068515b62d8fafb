"""How the frames of a cycle follow each other, for a clock that stands still between them."""

from dataclasses import dataclass

from sim_bus.frame import Frame


@dataclass(frozen=True)
class Rhythm:
    """The frames that matter to virtual time.

    Attributes:
        opening_id: identifier of the frame that opens a cycle.
        opening_data: how its data begin.
        closing_id: identifier of the last torque frame, where torques act on arrival; None where
            they wait for the next opening frame.
        torque_ids: identifiers of all such torque frames.
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
