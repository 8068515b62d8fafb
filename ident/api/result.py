"""What every result of the Python interface has: a verdict, its figures, and files."""

import importlib
import importlib.util
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any, Generic, TypeVar

from ident.workflows.work import Work
from wamctl.arm.errors import write_text

WorkT = TypeVar("WorkT", bound=Work)


def table(rows: Sequence[dict[str, Any]]) -> Any:
    """Rows as a pandas DataFrame where pandas is installed, else as a list of dicts."""
    if importlib.util.find_spec("pandas") is None:
        return list(rows)
    return importlib.import_module("pandas").DataFrame(list(rows))


def html_table(caption: str, rows: Sequence[dict[str, Any]], most: int = 20) -> str:
    """Rows as a small HTML table; the rest is counted.

    Args:
        caption: a sentence above the table.
        rows: all with the same keys.
        most: number of rows to show.
    """
    shown = rows[:most]
    head = "".join(f"<th>{escape(key)}</th>" for key in (shown[0] if shown else {}))
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(_text(v))}</td>" for v in row.values()) + "</tr>"
        for row in shown
    )
    rest = f"<p>and {len(rows) - most} more rows</p>" if len(rows) > most else ""
    return f"<p>{escape(caption)}</p><table><tr>{head}</tr>{body}</table>{rest}"


def _text(value: Any) -> str:
    if value is None:
        return "–"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


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
        write_text(path, self.run.page())
        return Path(path)

    def save(self, folder: str | Path) -> Path:
        """Write the files that the command writes.

        Raises:
            DataError: the folder cannot be written.
        """
        self.run.write(Path(folder))
        return Path(folder)
