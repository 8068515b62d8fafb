"""Blocks that more than one page has: errors per joint, and torque over time."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ident.report.charts import Chart, Curve, Panel, kept_samples, line_chart, row_chart, spans_of
from ident.report.page import Block, Column, Figure, Table, Text
from ident.report.style import ESTIMATOR_SIGNS, MEASURED, PREDICTED, RESIDUAL, Sign
from ident.report.traces import Trace
from ident.report.words import (
    estimator_text,
    known,
    number,
    percent,
    unit_text,
    with_unit,
)

MOST_RECORDINGS = 4
"""Torque is drawn for so many recordings; the tables have all of them."""

_UNKNOWN = Sign("#000000", "ring")


def error_figure(
    labels: Sequence[str],
    errors: Mapping[str, Any],
    chosen: str,
    units: Sequence[str],
    title: str,
) -> Figure:
    """Relative error of each estimator, joint by joint.

    Args:
        labels: of the joints.
        errors: by estimator, as the result files hold them.
        chosen: the estimator that made the model.
        units: of the joints' torque or force.
        title: what is shown.
    """
    values = {
        estimator_text(name): (
            ESTIMATOR_SIGNS.get(name, _UNKNOWN),
            [e["relative_error_percent"], *e["relative_error_percent_by_joint"]],
        )
        for name, e in errors.items()
    }
    caption = (
        "Size of the torque that the model leaves unexplained, relative to the torque itself."
        " Further left is better; equal steps along the axis are equal factors. Of markers at one"
        " place only the last is seen."
    )
    rows = ["all joints", *labels]
    chart = row_chart(title, "relative torque error [%]", rows, values, factors=True, wide=True)
    return Figure(title, caption, [chart], _error_table(labels, errors, chosen, units))


def _error_table(
    labels: Sequence[str], errors: Mapping[str, Any], chosen: str, units: Sequence[str]
) -> Table:
    """The same in numbers, with the chosen model's residual in units of torque."""
    columns = [Column("joint", "words")]
    columns += [Column(f"{estimator_text(name)} [%]") for name in errors]
    columns.append(Column(f"rms residual, {estimator_text(chosen)}"))
    whole = [number(e["relative_error_percent"]) for e in errors.values()]
    rows = [["all joints", *whole, number(None)]]
    for j, label in enumerate(labels):
        shares = [number(e["relative_error_percent_by_joint"][j]) for e in errors.values()]
        rows.append([label, *shares, with_unit(errors[chosen]["rms_by_joint"][j], units[j])])
    return Table("Relative torque error.", columns, rows, strong=frozenset({0}))


def torque_blocks(
    traces: Sequence[Trace],
    labels: Sequence[str],
    units: Sequence[str],
    errors: Sequence[Mapping[str, Any]],
    what: str,
) -> list[Block]:
    """Measured, predicted, and residual torque of each recording's joints.

    Args:
        traces: the recordings.
        labels: of the joints.
        units: of the joints' torque or force.
        errors: of each recording, or of all together if there is one only.
        what: what the caption says of the prediction.
    """
    blocks: list[Block] = []
    for i, trace in enumerate(traces[:MOST_RECORDINGS]):
        alone = len(errors) == len(traces)
        error = errors[i] if alone else None
        shown = [j for j in range(len(labels)) if trace.counted[:, j].any()]
        caption = (
            f"{what} The lower panel shows the residual, measured minus predicted, on a scale of"
            " its own. Grey: slow samples, around reversals of the joint, which the fit and the"
            " errors leave out."
        )
        heads = ("rms residual", "relative error", "largest residual, slow samples included")
        columns = [Column("joint", "words"), *map(Column, heads)]
        rows = [_row(trace, error, j, labels[j], units[j]) for j in shown]
        table = Table("Residual torque of each joint.", columns, rows)
        charts = [_chart(trace, j, labels[j], unit_text(units[j])) for j in shown]
        blocks.append(Figure(Path(trace.name).name, caption, charts, table))
    if len(traces) > MOST_RECORDINGS:
        rest = len(traces) - MOST_RECORDINGS
        blocks.append(Text(f"{rest} more recordings are in the tables only."))
    return blocks


def _row(
    trace: Trace, errors: Mapping[str, Any] | None, joint: int, label: str, unit: str
) -> list[str]:
    left = trace.measured[:, joint] - trace.predicted[:, joint]
    rms = float(np.sqrt(np.mean(left[trace.counted[:, joint]] ** 2)))
    percentage = None
    if errors is not None and known(errors["rms_by_joint"][joint]):
        rms, percentage = (
            errors[k][joint] for k in ("rms_by_joint", "relative_error_percent_by_joint")
        )
    largest = with_unit(float(np.nanmax(np.abs(left))), unit)
    return [label, with_unit(rms, unit), percent(percentage), largest]


def _chart(trace: Trace, joint: int, label: str, unit: str) -> Chart:
    measured, predicted = trace.measured[:, joint], trace.predicted[:, joint]
    kept = kept_samples(measured, measured - predicted)
    panels = [
        Panel(
            f"torque [{unit}]",
            [
                Curve("measured", MEASURED, measured[kept]),
                Curve("predicted", PREDICTED, predicted[kept]),
            ],
        ),
        Panel(f"residual [{unit}]", [Curve("residual", RESIDUAL, minus=(0, 1))], height=90),
    ]
    slow = spans_of(trace.t, ~trace.counted[:, joint])
    x = ("time [s]", trace.t[kept])
    return line_chart(label, x, panels, shaded=slow, joint=label)
