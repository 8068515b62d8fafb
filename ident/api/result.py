"""What every result of the Python interface has: a verdict, its figures, and files."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from ident.workflows.work import Work
from wamctl.arm.errors import writing

WorkT = TypeVar("WorkT", bound=Work)


@dataclass(frozen=True, repr=False)
class Result(Generic[WorkT]):
    """A result, with the files that the command of the same work writes.

    Attributes:
        run: the command's work with all its figures.
    """

    run: WorkT

    def __repr__(self) -> str:
        """What was found, in a line."""
        return f"<{type(self).__name__}: {self.summary}>"

    @property
    def content(self) -> dict[str, Any]:
        """The content of the command's JSON file."""
        return self.run.content

    @property
    def verdict(self) -> str:
        """The verdict in a word."""
        return self.content["verdict"]

    @property
    def summary(self) -> str:
        """The result in a line."""
        return self.verdict

    @property
    def remarks(self) -> list[dict[str, Any]]:
        """Remarks about the data, and reasons of the verdict: code, joints, sentence."""
        return self.content.get("remarks", [])

    def report(self, path: str | Path) -> Path:
        """Write the report, one HTML page, and give its path.

        Raises:
            DataError: the file cannot be written.
        """
        with writing(path):
            Path(path).write_text(self.run.page(), encoding="utf-8")
        return Path(path)

    def save(self, folder: str | Path) -> Path:
        """Write the files that the command writes.

        Raises:
            DataError: the folder cannot be written.
        """
        self.run.write(Path(folder))
        return Path(folder)
