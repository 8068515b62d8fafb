"""The state of loop, bus and drives as numbers, ten times a second, in the ring and back."""

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass
from enum import IntEnum

from wamctl.arm.arrays import Array
from wamctl.arm.ros2.log_messages import Status

_OK, _WARN = 0, 1


class Phase(IntEnum):
    """Phases of the experiment; `BRAKE` and `CUT_OFF` end it early, `TEST` comes behind `ENABLE`.

    `IDLE` comes before the first phase, and is the only one of `wamctl bench`.
    """

    IDLE = 0
    ENABLE = 1
    APPROACH = 2
    EXCITE = 3
    RETURN = 4
    RELEASE = 5
    DISABLE = 6
    BRAKE = 7
    CUT_OFF = 8
    TEST = 9

    @property
    def word(self) -> str:
        """The phase in lower case, for sentences."""
        return self.name.lower().replace("_", " ")


@dataclass(frozen=True)
class LoopStatus:
    """How the loop fares.

    Attributes:
        phase: a `Phase`.
        cycles: cycles so far.
        missed_deadlines: deadlines that passed unused.
        lost_frames, late_frames, bad_frames: positions that never came, came too late, or other
            frames that nobody understood.
        latency_us, cycle_us: of the last cycle, wake-up after its deadline and SYNC to last torque.
        clipped: motor torques that the gate had to limit.
    """

    phase: float
    cycles: float
    missed_deadlines: float
    lost_frames: float
    late_frames: float
    bad_frames: float
    latency_us: float
    cycle_us: float
    clipped: float


NUMBERS = len(LoopStatus.__dataclass_fields__)


def store(row: Array, status: LoopStatus, states: Sequence[int]) -> None:
    """Put a status into a record of the ring."""
    row[:NUMBERS] = astuple(status)
    row[NUMBERS : NUMBERS + len(states)] = states


def diagnostics(row: Array, drives: Sequence[str], names: Mapping[int, str]) -> list[Status]:
    """The entries of a diagnostics message from a record of the ring.

    Args:
        row: the record.
        drives: name of each drive.
        names: the drives' state in words, by its number.
    """
    status = LoopStatus(*row[:NUMBERS].tolist())
    faults = status.missed_deadlines + status.lost_frames
    values = {k: f"{v:.0f}" for k, v in vars(status).items() if k != "phase"}
    loop = Status("loop", _WARN if faults else _OK, Phase(int(status.phase)).word, "", values)
    codes = row[NUMBERS : NUMBERS + len(drives)].astype(int).tolist()
    return [
        loop,
        *(
            Status(name, _OK, names.get(code, f"unknown state {code:#x}"))
            for name, code in zip(drives, codes, strict=True)
        ),
    ]
