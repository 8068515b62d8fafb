"""The page of `ident export --replay`: the exported arm in MuJoCo beside a recording."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ident.export.replay import Replay, rms_of
from ident.report.charts import Chart
from ident.report.figures import beside_measured, recording_figures, row_figure
from ident.report.page import Block, Figure, Page, Points, Section, Step, Table, Verdict
from ident.report.style import BLUE, ORANGE, WITH, Sign
from ident.report.words import number
from ident.signals.arrays import Array
from wamctl.arm.joint_labels import joint_labels

_NAMES = {"mujoco": "MuJoCo", "own": "ident simulate"}
_MUJOCO = Sign(ORANGE, width=2.6)  # below our own, seen beside it where both are alike
_POINTS = Sign(ORANGE, "square"), Sign(BLUE, "ring")
_ALIKE = 1.2
"""Joint errors of MuJoCo up to so many times our own count as alike, and those that are larger by
less than half a step of the recorded positions."""
_ROUNDING = 1e-9  # rad


@dataclass(frozen=True)
class ReplayReport:
    """What the page is made of.

    Attributes:
        arm: its name.
        file: the exported file.
        model: the file of the model.
        left_out: what the format has no place for, in sentences.
        replays: at least one.
    """

    arm: str
    file: Path
    model: Path
    left_out: Sequence[str]
    replays: Sequence[Replay]


def replay_page(report: ReplayReport) -> Page:
    """The page of a replay."""
    first = report.replays[0]
    labels = joint_labels(first.joints)
    errors = rms_of(report.replays)
    largest = {name: 1e3 * max(values) for name, values in errors.items()}
    missing = [Points([f"{s[0].upper()}{s[1:]}." for s in report.left_out])]
    return Page(
        command="ident export",
        title=f"{report.arm}: the exported arm in MuJoCo, beside the recording",
        verdict=_verdict(errors, labels, report),
        figures=[(f"{x:.3g} mrad", f"{_NAMES[name]}, worst joint") for name, x in largest.items()],
        sections=[
            Section("Joint by joint", [_errors(errors, labels)]),
            Section("Measured and simulated positions", _positions(report.replays, labels)),
            *([Section("What the file has no place for", missing)] if report.left_out else []),
        ],
        steps=[
            Step("Ask which effect is still missing:", ["ident", "gap", first.name]),
            Step(
                "Compare the model's torque with the recording's:",
                ["ident", "validate", first.name, "--model", str(report.model)],
            ),
        ],
    )


def _steps(replays: Sequence[Replay]) -> Array:
    """Smallest step of the recorded positions of each joint [rad], shape (n,)."""
    moved = np.abs(np.concatenate([np.diff(r.measured, axis=0) for r in replays]))
    return np.min(np.where(moved > _ROUNDING, moved, np.inf), axis=0)


def _verdict(
    errors: dict[str, list[float]], labels: Sequence[str], report: ReplayReport
) -> Verdict:
    mujoco, own = (np.array(errors[name]) for name in _NAMES)
    steps = _steps(report.replays)
    larger = (mujoco > _ALIKE * own) & (mujoco - own > 0.5 * steps)
    apart = np.flatnonzero(larger).tolist()
    worst = int(mujoco.argmax())
    sentence = (
        "Along the recording, in closed loop, MuJoCo is at most"
        f" {1e3 * mujoco[worst]:.3g} mrad (rms, {labels[worst]}) from where the arm was measured;"
        f" our own simulation is {1e3 * own[worst]:.3g} mrad from it there."
    )
    if not apart:
        more = (
            f"At no joint is MuJoCo's error more than {_ALIKE:g} times our own, and larger by more"
            " than half a step of the recorded positions."
        )
        return Verdict("good", "alike", sentence, [more])
    names = ", ".join(labels[k] for k in apart)
    why = (
        "the file has no place for a part of the model" if report.left_out else "the solvers differ"
    )
    more = f"MuJoCo's error is more than {_ALIKE:g} times our own at {names}: {why}."
    return Verdict("warning", "not alike", sentence, [more])


def _errors(errors: dict[str, list[float]], labels: Sequence[str]) -> Figure:
    values = {
        _NAMES[name]: (sign, [1e3 * x for x in errors[name]])
        for name, sign in zip(_NAMES, _POINTS, strict=True)
    }
    pairs = zip(*(errors[name] for name in _NAMES), strict=True)
    return row_figure(
        "Position error by joint",
        "Rms of measured less simulated position. Further left is better; equal steps along the"
        " axis are equal factors.",
        "rms position error [mrad]",
        labels,
        values,
        more={"ratio": [number(a / b if b else None) for a, b in pairs]},
        factors=True,
    )


def _positions(replays: Sequence[Replay], labels: Sequence[str]) -> list[Block]:
    caption = (
        "Measured position, and both simulations from the same start under the recording's"
        " commands or controller. Below, measured less simulated."
    )
    heads = ["joint", *(f"largest, {name} [mrad]" for name in _NAMES.values())]

    def figure(one: Replay) -> Figure:
        left = [1e3 * np.abs(one.measured - y).max(axis=0) for y in (one.mujoco, one.own)]
        rows = [[label, *map(number, x)] for label, *x in zip(labels, *left, strict=True)]
        charts = [_chart(one, j, label) for j, label in enumerate(labels)]
        table = Table("Measured less simulated.", heads, rows)
        return Figure(Path(one.name).name, caption, charts, table)

    return recording_figures(replays, figure, "errors")


def _chart(one: Replay, j: int, label: str) -> Chart:
    models = {
        _NAMES["mujoco"]: (_MUJOCO, one.mujoco[:, j]),
        _NAMES["own"]: (WITH, one.own[:, j]),
    }
    return beside_measured(label, one.t, "position [rad]", one.measured[:, j], models)
