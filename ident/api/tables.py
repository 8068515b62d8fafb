"""Result tables, for notebooks."""

import importlib
import importlib.util
from collections.abc import Sequence
from html import escape
from typing import Any


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
