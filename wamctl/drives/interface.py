"""The one interface to the motor controllers: the loop knows no bus, frame or protocol beyond."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import can

from wamctl.arm.arrays import Array

WINDOW = 0.8
"""Share of the period in which the drives' answers to SYNC must have come."""


@dataclass(frozen=True)
class Readings:
    """What the drives said in one cycle; motors in the order of the configuration.

    Attributes:
        angle_motor: motor angle from the arm's zero pose, shape (n,) [rad]; NaN where none came.
        missing: places (0, 1, ...) of the drives whose angle did not come.
        late: those with an angle that came too late for its cycle, whether it is used or not.
        duplicates: those with more than one angle.
        out_of_order: those that answered out of order.
        enabled: every drive gives torque.
        disabled: no drive gives torque.
        fault: why the drives cannot be trusted any more, as the start of a sentence; or None.
        stop: why the arm should stop although they can, as the start of a sentence; or None.
    """

    angle_motor: Array
    missing: tuple[int, ...]
    enabled: bool
    disabled: bool
    fault: str | None
    stop: str | None = None
    late: tuple[int, ...] = ()
    duplicates: tuple[int, ...] = ()
    out_of_order: tuple[int, ...] = ()


class CycleTiming(Protocol):
    """What a cycle's clock says about its frames."""

    def remaining(self) -> float:
        """Time left to wait for frames [s]."""
        ...

    def age(self, stamp_s: float) -> float:
        """Time from this cycle's SYNC to a frame's time stamp [s]; negative for older frames."""
        ...


@dataclass
class Counters:
    """Frames that were not as they should be, since the start."""

    lost: int = 0
    late: int = 0
    doubled: int = 0
    reordered: int = 0
    malformed: int = 0
    foreign: int = 0
    lost_by_drive: dict[str, int] = field(default_factory=dict)


class Drives(Protocol):
    """Motor controllers that take torques and give angles once a cycle, on the motors' side.

    Life: `set_up`, `start`, then `sample` and `send` once a cycle, at the end `cut_off`. `enable`
    and `disable` only set the goal: the drives walk there in the cycles that follow, and
    `Readings` shows when they have arrived.

    Attributes:
        names: what to call each drive in a sentence.
        delay_cycles: a torque sent in cycle k acts from the sampling instant of cycle
            k + delay_cycles on.
        enabling_s: by then `enable` must have led every drive to where it gives torque [s].
        enabling_needs: what the operator must do for that; empty for nothing.
        state_names: the drives' states in the words of their standard, by number.
    """

    names: tuple[str, ...]
    delay_cycles: int
    enabling_s: float
    enabling_needs: str
    state_names: Mapping[int, str]

    @property
    def counters(self) -> Counters:
        """Bad frames so far."""
        ...

    def set_up(self) -> list[str]:
        """Check identities, configure, read back, without torque; returns notes for the operator.

        Raises:
            BusError: no answer or a wrong one; the message lists the faults of all drives.
        """
        ...

    def prepare(self) -> list[str]:
        """As `set_up`, for an arm that need not know its zero yet.

        Raises:
            BusError: as for `set_up`.
        """
        ...

    def define(self, angle_motor: Array) -> list[str]:
        """Declare where the motors are now, shape (n,) [rad]; returns what remains to be done.

        Raises:
            BusError: a drive does not answer, or does not take it.
        """
        ...

    def verify(self) -> None:
        """See whether every drive is still as `set_up` left it, and has not restarted since.

        Raises:
            BusError: no answer, a fault or another setting; the message lists all of them.
        """
        ...

    def resting_angles(self) -> Array:
        """Motor angles before the first cycle, shape (n,) [rad]."""
        ...

    def start(self) -> None:
        """Bring the drives to where the cycle can begin, every torque primed with zero."""
        ...

    def sample(self, timing: CycleTiming) -> Readings:
        """Ask for the angles of this instant and collect them.

        Args:
            timing: how long to wait for frames, and how old they are.

        Raises:
            BusStopError: the bus itself does not work any more.
        """
        ...

    def send(self, tau_motor: Array, at_once: bool = False) -> Array:
        """Send motor torques, shape (n,) [N m]; returns them as rounded on the wire.

        Where torques take effect between two sampling instants, the mean of the old and the new
        ones over that period is returned: it is what moves the arm.

        Args:
            tau_motor: the torques.
            at_once: a stop, which must not wait for the next sampling instant to act.

        Raises:
            BusStopError: the bus itself does not work any more.
        """
        ...

    def enable(self) -> None:
        """From now on, walk every drive to where it gives torque."""
        ...

    def disable(self) -> None:
        """From now on, walk every drive to where it gives none."""
        ...

    def is_own(self, frame: can.Message) -> bool:
        """Whether only a master of these drives sends such a frame."""
        ...

    def states(self) -> list[int]:
        """State of each drive as a number."""
        ...

    def cut_off_frames(self) -> list[can.Message]:
        """The frames of `cut_off`, for another process to send; nothing changes here."""
        ...

    def cut_off(self) -> None:
        """Take torque away without waiting for any answer. Never raises; safe to call twice."""
        ...
