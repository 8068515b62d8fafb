"""Errors of identification: each a whole sentence, with exit code 6."""

from wamctl.arm.errors import DataError


class JointMismatchError(DataError):
    """The recording and the robot do not have the joints in common that they need."""

    def __init__(self, log: str, missing: list[str], present: tuple[str, ...]) -> None:
        self.log = log
        self.missing = missing
        self.present = present
        super().__init__(log, missing, present)

    def __str__(self) -> str:
        wanted = ", ".join(repr(m) for m in self.missing)
        return f"{self.log} has no joint {wanted}; its joints are {', '.join(self.present)}."


class TooShortError(DataError):
    """A recording, or an unbroken stretch of it, is shorter than the filter needs."""

    def __init__(self, log: str, seconds: float, needed: float, cutoff_hz: float) -> None:
        self.log = log
        self.seconds = seconds
        self.needed = needed
        self.cutoff_hz = cutoff_hz
        super().__init__(log, seconds, needed, cutoff_hz)

    advice = "Record for longer, or raise --cutoff."

    @property
    def finding(self) -> str:
        """What is too short."""
        return (
            f"The longest unbroken stretch of {self.log} lasts {self.seconds:.3g} s, but a filter"
            f" with a cut-off of {self.cutoff_hz:g} Hz needs {self.needed:.3g} s."
        )

    def __str__(self) -> str:
        return f"{self.finding} {self.advice}"


class ArmsDifferError(DataError):
    """Logs that carry different arms cannot be fitted together."""

    def __init__(self, first: str, other: str) -> None:
        self.first = first
        self.other = other
        super().__init__(first, other)

    def __str__(self) -> str:
        return (
            f"{self.first} and {self.other} carry different robot.urdf files:"
            " name one arm with --robot."
        )
