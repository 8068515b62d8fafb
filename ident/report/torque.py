"""Blocks that more than one page has: errors per joint, and torque over time."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ident.report.figures import Series, torque_over_time
from ident.report.page import Block, Column, Gallery, Table, Text
from ident.report.row_figures import Dots, dots
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


def sign_of(estimator: str) -> Sign:
    """How an estimator looks in figures."""
    return ESTIMATOR_SIGNS.get(estimator, _UNKNOWN)


def error_figure(labels: Sequence[str], errors: Mapping[str, Any], title: str) -> Gallery:
    """Relative error of each estimator, joint by joint.

    Args:
        labels: of the joints.
        errors: by estimator, as the result files hold them.
        title: what is shown.
    """
    values = {
        name: [e["relative_error_percent"], *e["relative_error_percent_by_joint"]]
        for name, e in errors.items()
    }
    content = Dots(
        title,
        "relative torque error [%]",
        ["all joints", *labels],
        values,
        {name: sign_of(name) for name in values},
        {name: estimator_text(name) for name in values},
    )
    caption = (
        f"{title}: size of what is left of the torque, beside the size of the torque itself."
        " Further left is better; each step of the grid is a factor, not a sum."
    )
    return Gallery([dots(content)], caption)


def error_table(
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
    return Table("The same in numbers.", columns, rows, strong=frozenset({0}))


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
        error = errors[min(i, len(errors) - 1)] if len(errors) in (1, len(traces)) else None
        shared = len(errors) == 1 and len(traces) > 1
        notes = [_note(None if shared else error, j, units[j]) for j in range(len(labels))]
        drawings = [
            torque_over_time(_series(trace, j, labels[j], unit_text(units[j]), notes[j]))
            for j in range(len(labels))
            if trace.counted[:, j].any()
        ]
        caption = (
            f"{Path(trace.name).name}: {what} Below each plot, what is left, on a scale of its own;"
            " slow samples that were culled leave gaps there."
        )
        signs = [("measured", MEASURED), ("predicted", PREDICTED), ("residual", RESIDUAL)]
        blocks.append(Gallery(drawings, caption, signs))
    if len(traces) > MOST_RECORDINGS:
        rest = len(traces) - MOST_RECORDINGS
        blocks.append(Text(f"{rest} more recordings are in the tables only."))
    return blocks


def _note(errors: Mapping[str, Any] | None, joint: int, unit: str) -> str:
    if errors is None or not known(errors["rms_by_joint"][joint]):
        return ""
    rms = with_unit(errors["rms_by_joint"][joint], unit, 2)
    return f"rms residual {rms} ({percent(errors['relative_error_percent_by_joint'][joint], 2)})"


def _series(trace: Trace, joint: int, label: str, unit: str, note: str) -> Series:
    measured, predicted = trace.measured[:, joint], trace.predicted[:, joint]
    return Series(label, unit, trace.t, measured, predicted, trace.counted[:, joint], note)
