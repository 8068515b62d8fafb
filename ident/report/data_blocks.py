"""Blocks of the run page on the data: slow samples, motion, conditioning."""

from pathlib import Path

import numpy as np

from ident.report.charts import Curve, Panel, line_chart
from ident.report.page import Block, Figure, Points, Table, Text, table_of
from ident.report.style import BLUE, GREY, ORANGE, Sign
from ident.report.words import DASH, Content, number, plus_minus, setting, whole


def culling_blocks(content: Content) -> list[Block]:
    """What leaving out slow samples does, with its controls (Fig. 2)."""
    culling = content["culling"]
    x = np.array(culling["thresholds_rad_s"])
    at = content["velocity_threshold"]
    signs = {
        "slow": ("slow samples left out", Sign(BLUE)),
        "random": ("as many at random", Sign(GREY, dash=(5, 3))),
        "other": ("as many at other speeds", Sign(ORANGE, dash=(1.5, 3))),
    }
    measures = {"mse": "mean squared residual [N²·m²]", "condition_number": "condition number [1]"}
    charts, heads = [], ["threshold [rad/s]"]
    rows = [[setting(float(v))] for v in x]
    for key, label in measures.items():
        curves = []
        for kind, (words, sign) in signs.items():
            y = np.array(culling[kind][key], dtype=float)
            curves.append(Curve(words, sign, y, points=True))
            heads.append(f"{label}, {words}")
            rows = [[*row, number(float(v))] for row, v in zip(rows, y, strict=True)]
        over = ("velocity threshold [rad/s]", x)
        charts.append(line_chart(label.partition(" [")[0], over, [Panel(label, curves)], at=at))
    caption = (
        "Static friction is not in the model and shows only near zero velocity, so the fit leaves"
        " out (culls) samples of joints that are slower than a threshold. Leaving slow samples out"
        " should lower the error, and leaving as many out at random or at other speeds should not;"
        " the condition number should hardly rise (the paper's Fig. 2). Vertical line: the"
        " threshold of this fit. As in the paper, friction changes sign at once here, so that"
        " both numbers differ from those of the fit itself."
    )
    choice = setting(culling["automatic_choice_rad_s"])
    table = Table("Error and conditioning over the threshold.", heads, rows)
    return [
        Figure("Which samples to leave out", caption, charts, table),
        Text(f"By this figure, {choice}\u202frad/s would be enough."),
    ]


def motion_blocks(content: Content) -> list[Block]:
    """Conditioning, filter, and the recordings."""
    logs = [
        log | {"delay": plus_minus(_milli(d["seconds"]), _milli(d["sd"]))}
        for log, d in zip(content["logs"], content["delays"], strict=True)
    ]
    table = table_of(
        "The recordings (± standard error).",
        logs,
        {
            "recording": lambda log: Path(log["name"]).name,
            "samples": lambda log: whole(log["samples"]),
            "rate [Hz]": lambda log: setting(log["sample_rate_hz"]),
            "cut-off [Hz]": lambda log: setting(log["cutoff_hz"]),
            "torque": lambda log: log["torque"],
            "torque acts later by [ms]": lambda log: log["delay"],
            "remarks": lambda log: "; ".join(log["remarks"]) or DASH,
        },
    )
    facts = [
        f"{whole(content['rows'])} rows of joint torque entered the fit; their regressor W has rank"
        f" {content['rank']} and condition number {number(content['condition_number'])}"
        " (smaller is better; 1 is ideal).",
        f"Cut-off of the low-pass: {content['cutoff_from']}.",
    ]
    return [Points(facts), table]


def _milli(value: float | None) -> float | None:
    return None if value is None else 1e3 * value
