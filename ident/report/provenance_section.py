"""The last section of each page: by what, from what, and how long."""

from collections.abc import Mapping
from typing import Any

from ident.report.page import Beside, Block, Section, Table, Text
from ident.report.words import Content, number, setting


def provenance_section(content: Content) -> Section:
    """Versions, settings, logs, solver, and times, as far as the result file has them."""
    blocks: list[Block] = []
    solver = content.get("solver")
    if solver:
        took = number(solver["seconds"], 2)
        blocks.append(
            Text(f"Solver: {solver['name']}, which ended with {solver['status']!r} after {took} s.")
        )
    tables = []
    if isinstance(content.get("seconds"), Mapping):
        rows = [[name, number(s, 2)] for name, s in content["seconds"].items()]
        tables.append(Table("Time spent.", ("step", "time [s]"), rows))
    for name, caption in (
        ("program", "Program and libraries."),
        ("arm", "Arm."),
        ("logs", "Logs (SHA-256)."),
        ("settings", "Settings."),
    ):
        facts = content.get("provenance", {}).get(name)
        if facts:
            rows = [[key, _text(value)] for key, value in facts.items()]
            tables.append(Table(caption, ("what", "value"), rows))
    return Section("Versions, settings, and times", [*blocks, Beside(tables)], folded=True)


def _text(value: Any) -> str:
    if value is None:
        return "not set"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list | tuple):
        return ", ".join(map(_text, value)) or "none"
    return setting(value) if isinstance(value, float) else str(value)
