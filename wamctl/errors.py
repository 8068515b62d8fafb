"""How a command of wamctl ends when it cannot do its work: one sentence and an exit code."""

from wamctl.arm.errors import UserError

_ITS_EXIT_CODES = (2, 3)  # usage and configuration: what the user wrote, not the bus


class UsageError(UserError):
    """The command was called in a way that it cannot serve; the message is the whole sentence."""

    exit_code = 2


class BusError(UserError):
    """The bus or a drive on it cannot be used; the message is the whole sentence."""

    exit_code = 4


class SimulatedArmError(UserError):
    """The embedded simulated arm cannot serve; its last line says why, its exit code counts."""

    def __init__(self, what: str, said: str, exit_code: int) -> None:
        self.exit_code = exit_code if exit_code in _ITS_EXIT_CODES else BusError.exit_code
        super().__init__(what, said)
        self.what = what
        self.said = said

    def __str__(self) -> str:
        lines = self.said.strip().splitlines()
        return f"The simulated arm {self.what}: {lines[-1] if lines else 'it was silent.'}"


class SilentDriveError(BusError):
    """A drive gives no answer at all."""


class DrivesError(BusError):
    """Drives that did not pass their set-up.

    Attributes:
        channel: the bus.
        faults: every fault of every drive.
        nobody: whether not one drive of the arm answers, so that the reason is none of theirs.
    """

    def __init__(self, channel: str, faults: list[str], nobody: bool = False) -> None:
        self.channel = channel
        self.faults = faults
        self.nobody = nobody
        super().__init__(channel, faults, nobody)

    def __str__(self) -> str:
        if self.nobody:
            return (
                f"No drive answers on bus {self.channel}, and none was enabled: check their power,"
                " the cable and its terminators, the bit rate, and whether they speak the"
                " configuration's protocol (CANopen: wam7.yaml; classic Pucks: wam7-classic.yaml)."
            )
        if len(self.faults) == 1:
            return f"{self.faults[0]} (bus {self.channel}). No drive was enabled."
        lines = "\n".join(f"  - {fault}" for fault in self.faults)
        return f"{len(self.faults)} faults on bus {self.channel}; no drive was enabled:\n{lines}"


class RefusalError(UserError):
    """The arm stays where it is: the motion to come would break limits, listed in `faults`."""

    exit_code = 5

    def __init__(self, what: str, faults: list[str]) -> None:
        self.what = what
        self.faults = faults
        super().__init__(what, faults)

    def __str__(self) -> str:
        head = f"{self.what} is refused, and no drive was enabled"
        if len(self.faults) == 1:
            return f"{head}: {self.faults[0]}."
        return f"{head}; {len(self.faults)} faults:\n" + "\n".join(f"  - {f}" for f in self.faults)


class StopError(UserError):
    """The running experiment was ended before its time.

    Attributes:
        cause: who did what, with value, unit and bound.
        brakes: whether drives and readings can still be trusted, so that the arm can be braked.
        at_s: time since the first SYNC [s], set by the loop.
        phase: what the arm was doing, set by the loop.
        outcome: what was done about it, set by the experiment.
    """

    exit_code = 5

    def __init__(self, cause: str, brakes: bool = True) -> None:
        super().__init__(cause)
        self.cause = cause
        self.brakes = brakes
        self.at_s = 0.0
        self.phase = ""
        self.outcome = ""

    def __str__(self) -> str:
        when = f"{self.at_s:.3f} s after the first SYNC"
        return f"{self.cause}, {when} in phase {self.phase!r}: {self.outcome}."


class SafetyStopError(StopError):
    """A limit, the operator, or the log ended the experiment."""

    exit_code = 5


class OutsideStopError(SafetyStopError):
    """The operator, this computer or the log ended the experiment; the arm itself is well."""


class BusStopError(StopError):
    """A drive or the bus ended the experiment."""

    exit_code = 4

    def __init__(self, cause: str) -> None:
        super().__init__(cause, brakes=False)
