"""What holds a recording, for callers that need no more of it."""

from typing import Protocol, runtime_checkable

from wamctl.arm.recording import Recording


@runtime_checkable
class Logged(Protocol):
    """What holds a recording, such as an `ident.Recording`."""

    @property
    def log(self) -> Recording:
        """The recording."""
        ...
