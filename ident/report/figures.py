"""Figures that more than one page has: values row by row, errors by joint, curves over time."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.estimation.regression_data import ReducedRecording
from ident.identification.identify import Identification
from ident.identification.validation import Prediction
from ident.report.charts import Chart, Curve, Panel, kept_samples, line_chart, row_chart, spans_of
from ident.report.page import Block, Figure, Item, Table, Text
from ident.report.style import ESTIMATOR_SIGNS, MEASURED, PREDICTED, RESIDUAL, Sign
from ident.report.words import (
    Content,
    estimator_text,
    known,
    number,
    percent,
    unit_text,
    whole,
    with_unit,
)
from ident.signals.arrays import Array

ALL_JOINTS = "all joints"
"""A row that is bold in the table."""

_MOST_RECORDINGS = 4  # that are drawn; the tables have all of them
_UNKNOWN = Sign("#000000", "ring")


@dataclass(frozen=True)
class Trace:
    """One recording.

    Attributes:
        name: of the log.
        t: time [s], shape (E,).
        measured, predicted: torque of all joints [N m], or force [N], shape (E, n) each.
        counted: samples that the errors count, shape (E, n); the others were culled.
    """

    name: str
    t: Array
    measured: Array
    predicted: Array
    counted: NDArray[np.bool_]


def held_out_traces(found: Identification) -> tuple[Trace, ...]:
    """The recordings of the fit, each stretch predicted by a fit that has not seen it."""
    predicted = found.held_out[found.chosen].predicted
    return tuple(_trace(log, p) for log, p in zip(found.evidence.logs, predicted, strict=True))


def validation_trace(prediction: Prediction, estimator: str) -> Trace:
    """A recording that the model was not fitted on."""
    log = prediction.evidence.logs[0]
    return _trace(log, log.reduction.excerpt.W @ prediction.betas[estimator])


def _trace(log: ReducedRecording, predicted: Array) -> Trace:
    excerpt = log.reduction.excerpt
    return Trace(log.data.name, excerpt.t, excerpt.tau, predicted, excerpt.kept)


def row_figure(
    title: str,
    caption: str,
    quantity: str,
    rows: Sequence[str],
    values: Mapping[str, tuple[Sign, Sequence[float | None]]],
    *,
    head: str = "joint",
    more: Mapping[str, Sequence[str]] | None = None,
    **axis: bool,
) -> Figure:
    """Values of one or several kinds for each row as a chart, and the same in numbers.

    Args:
        title: what is shown.
        caption: how to read it.
        quantity: with its unit.
        rows: names.
        values: sign and one value for each row, by kind.
        head: what a row is.
        more: further columns of the table, in print.
        axis: as of `row_chart`: factors, joined.
    """
    chart = row_chart(title, quantity, rows, values, **axis)
    unit = quantity[quantity.index("[") :]
    heads = [f"{kind} {unit}" for kind in values] if len(values) > 1 else [quantity]
    columns = [[number(x) for x in column] for _, column in values.values()]
    cells = zip(rows, *columns, *(more or {}).values(), strict=True)
    strong = {k for k, row in enumerate(rows) if row == ALL_JOINTS}
    table = Table(f"{title}.", [head, *heads, *(more or {})], list(cells), strong)
    return Figure(title, caption, [chart], table)


def all_and_each(errors: Content) -> list[float | None]:
    """Relative error over all joints, and of each [%]."""
    return [errors["relative_error_percent"], *errors["relative_error_percent_by_joint"]]


def error_figure(
    labels: Sequence[str],
    errors: Content,
    chosen: str,
    units: Sequence[str],
    title: str,
) -> Figure:
    """Relative error of each estimator, joint by joint, and the chosen one's residual.

    Args:
        labels: of the joints.
        errors: by estimator, as the result files hold them.
        chosen: the estimator that made the model.
        units: of the joints' torque or force.
        title: what is shown.
    """
    values = {
        estimator_text(name): (ESTIMATOR_SIGNS.get(name, _UNKNOWN), all_and_each(e))
        for name, e in errors.items()
    }
    caption = (
        "Size of the torque that the model leaves unexplained, relative to the torque itself."
        " Further left is better; equal steps along the axis are equal factors. Of markers at one"
        " place only the last is seen."
    )
    rms = zip(errors[chosen]["rms_by_joint"], units, strict=True)
    residual = [number(None), *(with_unit(x, unit) for x, unit in rms)]
    return row_figure(
        title,
        caption,
        "relative torque error [%]",
        [ALL_JOINTS, *labels],
        values,
        more={f"rms residual, {estimator_text(chosen)}": residual},
        factors=True,
    )


def recording_figures(
    recordings: Sequence[Item], figure: Callable[[Item], Figure], others: str = "tables"
) -> list[Block]:
    """A figure of each of the first recordings; of the others, that they are elsewhere."""
    blocks: list[Block] = [figure(one) for one in recordings[:_MOST_RECORDINGS]]
    rest = len(recordings) - _MOST_RECORDINGS
    if rest > 0:
        blocks.append(Text(f"{whole(rest)} more recordings are in the {others} only."))
    return blocks


def beside_measured(
    label: str,
    t: Array,
    quantity: str,
    measured: Array,
    models: Mapping[str, tuple[Sign, Array]],
    beside: Mapping[str, tuple[Sign, Array]] | None = None,
    shaded: NDArray[np.bool_] | None = None,
    reach: float | None = None,
) -> Chart:
    """One joint over time as measured and by models, and below, measured minus modelled.

    Args:
        label: of the joint.
        t: [s], shape (S,).
        quantity: what is measured, with its unit.
        measured: shape (S,).
        models: sign and values of each, shape (S,), by name.
        beside: further curves of the upper panel.
        shaded: samples with a grey ground, shape (S,).
        reach: end of the lower panel's axis; None: at the values.
    """
    others = beside or {}
    lefts = (measured - y for _, y in models.values())
    kept = kept_samples(measured, *lefts, *(y for _, y in others.values()))
    upper = {"measured": (MEASURED, measured), **models, **others}
    left = [
        Curve(name, sign, minus=(0, k)) for k, (name, (sign, _)) in enumerate(models.items(), 1)
    ]
    if len(left) == 1:
        left = [Curve("residual", RESIDUAL, minus=(0, 1))]
    unit = quantity[quantity.index("[") :]
    panels = [
        Panel(quantity, [Curve(name, sign, y[kept]) for name, (sign, y) in upper.items()]),
        Panel(f"residual {unit}", left, height=110, reach=reach),
    ]
    spans = [] if shaded is None else spans_of(t, shaded)
    return line_chart(label, ("time [s]", t[kept]), panels, shaded=spans, joint=label)


def torque_blocks(
    traces: Sequence[Trace],
    labels: Sequence[str],
    units: Sequence[str],
    errors: Sequence[Content],
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
    caption = (
        f"{what} The lower panel shows the residual, measured minus predicted, on a scale of"
        " its own. Grey: slow samples, around reversals of the joint, which the fit and the"
        " errors leave out."
    )
    heads = ("joint", "rms residual", "relative error", "largest residual, slow samples included")
    own = errors if len(errors) == len(traces) else [None] * len(traces)

    def figure(pair: tuple[Trace, Mapping[str, Any] | None]) -> Figure:
        trace, error = pair
        shown = [j for j in range(len(labels)) if trace.counted[:, j].any()]
        rows = [_row(trace, error, j, labels[j], units[j]) for j in shown]
        charts = [
            beside_measured(
                labels[j],
                trace.t,
                f"torque [{unit_text(units[j])}]",
                trace.measured[:, j],
                {"predicted": (PREDICTED, trace.predicted[:, j])},
                shaded=~trace.counted[:, j],
            )
            for j in shown
        ]
        table = Table("Residual torque of each joint.", heads, rows)
        return Figure(Path(trace.name).name, caption, charts, table)

    return recording_figures(list(zip(traces, own, strict=True)), figure)


def _row(trace: Trace, errors: Content | None, joint: int, label: str, unit: str) -> list[str]:
    left = trace.measured[:, joint] - trace.predicted[:, joint]
    rms = float(np.sqrt(np.mean(left[trace.counted[:, joint]] ** 2)))
    percentage = None
    if errors is not None and known(errors["rms_by_joint"][joint]):
        rms, percentage = (
            errors[k][joint] for k in ("rms_by_joint", "relative_error_percent_by_joint")
        )
    largest = with_unit(float(np.nanmax(np.abs(left))), unit)
    return [label, with_unit(rms, unit), percent(percentage), largest]
