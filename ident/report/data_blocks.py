"""Blocks of the run page on the data: slow samples, motion, conditioning."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ident.report.figures import Trend, sweep
from ident.report.page import Block, Column, Gallery, Points, Table, Text
from ident.report.style import BLUE, GREY, ORANGE, Sign
from ident.report.words import (
    DASH,
    number,
    plus_minus,
    setting,
    whole,
)

Content = Mapping[str, Any]


def culling_blocks(content: Content) -> list[Block]:
    """What leaving out slow samples does, with its controls (Fig. 2)."""
    culling = content["culling"]
    x = np.array(culling["thresholds_rad_s"])
    at = (content["velocity_threshold"], "threshold of the fit")
    signs = {
        "slow": ("slow samples left out", Sign(BLUE, "circle")),
        "random": ("as many at random", Sign(GREY, "square", dash="5 3")),
        "other": ("as many at other speeds", Sign(ORANGE, "diamond", dash="1.5 3")),
    }
    drawings = [
        sweep(
            title,
            ("velocity threshold [rad/s]", label),
            x,
            [Trend(w, s, np.array(culling[k][key], dtype=float)) for k, (w, s) in signs.items()],
            at,
        )
        for title, label, key in (
            ("Error", "mean squared residual [N²·m²]", "mse"),
            ("Conditioning", "condition number of W [1]", "condition_number"),
        )
    ]
    caption = (
        "Static friction is not in the model and shows near zero velocity only. Leaving slow"
        " samples out should lower the error, and leaving as many out at random or at other speeds"
        " should not; the condition number should hardly rise (the paper's Fig. 2)."
    )
    choice = setting(culling["automatic_choice_rad_s"])
    return [
        Gallery(drawings, caption, list(signs.values())),
        Text(f"The automatic rule would take {choice}\u202frad/s."),
    ]


def motion_blocks(content: Content) -> list[Block]:
    """Conditioning, filter, and the recordings."""
    columns = [
        Column("recording", "words"),
        Column("samples"),
        Column("rate [Hz]"),
        Column("cut-off [Hz]"),
        Column("torque", "words"),
        Column("torque acts later by [ms]"),
        Column("remarks", "words"),
    ]
    rows = [
        [
            Path(log["name"]).name,
            whole(log["samples"]),
            setting(log["sample_rate_hz"]),
            setting(log["cutoff_hz"]),
            log["torque"],
            plus_minus(_milli(d["seconds"]), _milli(d["sd"])),
            "; ".join(log["remarks"]) or DASH,
        ]
        for log, d in zip(content["logs"], content["delays"], strict=True)
    ]
    facts = [
        f"{whole(content['rows'])} rows of joint torque entered the fit; their regressor W has rank"
        f" {content['rank']} and condition number {number(content['condition_number'])}"
        " (smaller is better; 1 is ideal).",
        f"Cut-off of the low-pass: {content['cutoff_from']}.",
    ]
    return [Points(facts), Table("The recordings (± standard error).", columns, rows)]


def _milli(value: float | None) -> float | None:
    return None if value is None else 1e3 * value
