"""What the pages of a search share, by torque and by simulation alike."""

from collections.abc import Mapping, Sequence
from typing import Any

from ident.report.charts import row_chart
from ident.report.page import Block, Column, Figure, Status, Table
from ident.report.style import BLUE, Sign
from ident.report.words import known, number, plus_minus, quantity_text, unit_text

VERDICT_WORDS: dict[str, tuple[Status, str]] = {
    "no_gap": ("good", "nothing missing"),
    "named": ("good", "missing effect named"),
    "ambiguous": ("warning", "several explanations"),
    "unknown": ("open", "unknown effect"),
    "data_fault": ("bad", "fault in the data"),
}


def parameter_table(effect: Mapping[str, Any]) -> Table:
    """The parameters of an effect of `gap.json`."""
    rows = [
        [quantity_text(name), plus_minus(p["value"], p["sd"]), unit_text(p["unit"])]
        for name, p in effect["parameters"].items()
    ]
    columns = [Column("parameter", "words"), Column("value"), Column("unit", "words")]
    return Table("Its parameters, ± standard deviation.", columns, rows)


def where_blocks(
    where: Sequence[Mapping[str, Any]], labels: Sequence[str], caption: str
) -> list[Block]:
    """Shares of the gap by joint and speed, as `where` of `gap.json` holds them."""
    if not where:
        return []
    regions = [w["region"].replace("|qd| < ", "below ").replace("|qd| > ", "above ") for w in where]
    names = [labels[int(w["joint"]) - 1] for w in where]
    rows = [f"{name}, {region}" for name, region in zip(names, regions, strict=True)]
    shares = [100 * w["share_of_gap"] if known(w["share_of_gap"]) else None for w in where]
    quantity = "share of the gap [%]"
    chart = row_chart(quantity, quantity, rows, {"share": (Sign(BLUE, "bar"), shares)}, wide=True)
    columns = [Column("joint", "words"), Column("speed", "words"), Column(quantity)]
    cells = list(zip(names, regions, map(number, shares), strict=True))
    table = Table("Share of the gap.", columns, cells)
    return [Figure("Share of the gap", caption, [chart], table)]
