"""Errors that end a command with one sentence and an exit code."""

from pathlib import Path


class UserError(Exception):
    """Root of all errors that a user can meet; `exit_code` is the command's exit status.

    Exit codes: 1 a bug, 2 usage, 3 configuration, 4 bus or drive, 5 safety stop, 6 data or
    identification.
    """

    exit_code = 1


class ConfigurationError(UserError):
    """A configuration file that cannot be used; `faults` lists every fault, one sentence each."""

    exit_code = 3

    def __init__(self, path: Path | str, faults: list[str]) -> None:
        self.path = Path(path)
        self.faults = faults
        super().__init__(path, faults)

    def __str__(self) -> str:
        if len(self.faults) == 1:
            return f"{self.path}: {self.faults[0]}."
        return f"{self.path}: {len(self.faults)} faults:\n" + "\n".join(
            f"  - {f}" for f in self.faults
        )


class DataError(UserError):
    """A recording, model or table that cannot be used; the message is the whole sentence."""

    exit_code = 6
