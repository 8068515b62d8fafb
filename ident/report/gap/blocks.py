"""What the pages of a search share, by torque and by simulation alike."""

from collections.abc import Sequence

from ident.report.figures import row_figure
from ident.report.gap.report import SearchReport
from ident.report.page import Block, Status, Table, table_of
from ident.report.style import BLUE, Sign
from ident.report.words import Content, known, number, plus_minus, quantity_text, unit_text

VERDICT_WORDS: dict[str, tuple[Status, str]] = {
    "no_gap": ("good", "nothing missing"),
    "named": ("good", "missing effect named"),
    "ambiguous": ("warning", "several explanations"),
    "unknown": ("open", "unknown effect"),
    "data_fault": ("bad", "fault in the data"),
}


def parameter_table(effect: Content) -> Table:
    """The parameters of an effect of `gap.json`."""
    return table_of(
        "Its parameters, ± standard deviation.",
        effect["parameters"].items(),
        {
            "parameter": lambda p: quantity_text(p[0]),
            "value": lambda p: plus_minus(p[1]["value"], p[1]["sd"]),
            "unit": lambda p: unit_text(p[1]["unit"]),
        },
    )


def rival_blocks(report: SearchReport) -> list[Block]:
    """What explains the same as an effect that was named."""
    rivals = [r for e in report.content["effects"] for r in e["rivals"]]
    table = table_of(
        "Effects that explain the same part of the gap, the nearest first.",
        rivals,
        {
            "effect": lambda r: report.title(r["name"]),
            "where": lambda r: report.of(r["joints"]),
            "evidence [nats per sample]": lambda r: number(r["evidence"]),
        },
    )
    return [table] if rivals else []


def where_blocks(where: Sequence[Content], labels: Sequence[str], caption: str) -> list[Block]:
    """Shares of the gap by joint and speed, as `where` of `gap.json` holds them."""
    if not where:
        return []
    regions = [w["region"].replace("|qd| < ", "below ").replace("|qd| > ", "above ") for w in where]
    rows = [
        f"{labels[int(w['joint']) - 1]}, {region}" for w, region in zip(where, regions, strict=True)
    ]
    shares = [100 * w["share_of_gap"] if known(w["share_of_gap"]) else None for w in where]
    values = {"share": (Sign(BLUE, "bar"), shares)}
    title, quantity = "Share of the gap", "share of the gap [%]"
    return [row_figure(title, caption, quantity, rows, values, head="joint and speed")]
