"""Errors that end a command with one sentence and an exit code."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path


def did_you_mean(word: str, valid: Iterable[str]) -> str:
    """`; did you mean X?` with the most similar valid word; empty where none is similar."""
    near = get_close_matches(word, list(valid), 1)
    return f"; did you mean {near[0]}?" if near else ""


def reason_of(error: Exception) -> str:
    """Why a file cannot be read, without the path and the number that Python puts beside it."""
    if isinstance(error, OSError):
        return error.strerror or str(error)
    return f"it has no {error}" if isinstance(error, LookupError) else str(error)


class UserError(Exception):
    """Root of all errors that a user can meet; `exit_code` is the command's exit status.

    Exit codes: 1 a bug, 2 usage, 3 configuration, 4 bus or drive, 5 safety stop, 6 data or
    identification.
    """

    exit_code = 1


class ConfigurationError(UserError):
    """A configuration file that cannot be used.

    Attributes:
        path: the file, or the option.
        faults: every fault, one sentence each, without a full stop.
        advice: what to do about all of them, a sentence; empty where each fault says it.
    """

    exit_code = 3

    def __init__(self, path: Path | str, faults: list[str], advice: str = "") -> None:
        self.path = Path(path)
        self.faults = faults
        self.advice = advice
        super().__init__(path, faults, advice)

    def __str__(self) -> str:
        if len(self.faults) == 1:
            return f"{self.path}: {_ended(self.faults[0])} {self.advice}".rstrip()
        lines = [f"{self.path}: {len(self.faults)} faults:", *(f"  - {f}" for f in self.faults)]
        return "\n".join([*lines, self.advice]).rstrip()


def _ended(sentence: str) -> str:
    return sentence if sentence.endswith("?") else f"{sentence}."


class DataError(UserError):
    """A recording, model or table that cannot be used; the message is the whole sentence."""

    exit_code = 6


@contextmanager
def writing(path: Path | str) -> Iterator[None]:
    """What the system says where a file cannot be written, as a sentence.

    Raises:
        DataError: the block met an error of the system.
    """
    try:
        yield
    except OSError as error:
        raise DataError(
            f"{path} cannot be written ({error.strerror or error}): name another path."
        ) from error


def write_text(path: Path | str, text: str) -> None:
    """Write a file anew.

    Raises:
        DataError: it cannot be written.
    """
    with writing(path):
        Path(path).write_text(text, encoding="utf-8")
