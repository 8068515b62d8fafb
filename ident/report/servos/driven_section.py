"""The part of a page that compares recorded positions with those that the torque gives the arm."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ident.report.figures import beside_measured, recording_figures
from ident.report.page import Block, Figure, Section, Table, Text
from ident.report.style import PREDICTED
from ident.report.words import Content, number, plus_minus
from ident.signals.arrays import Array

_MOST_ROWS = 12


@dataclass(frozen=True)
class DrivenTrace:
    """One unbroken recording.

    Attributes:
        name: of the log.
        t: time [s], shape (S,).
        measured, simulated: [rad], shape (S, n) each.
    """

    name: str
    t: Array
    measured: Array
    simulated: Array


def driven_sections(
    content: Content, traces: Sequence[DrivenTrace], labels: Sequence[str]
) -> list[Section]:
    """Errors of position, and what regression says of the same parameters."""
    return [
        Section("How well the simulation follows", [_errors(content, labels)]),
        Section("Measured and simulated positions", _positions(traces, labels)),
        Section("Simulation and regression", _compared(content)),
    ]


def driven_sentence(content: Content) -> str:
    """How far the simulated arm is from the measured one, and whether the methods agree."""
    agree = content["agreement"]
    rms = np.array(content["held_out"]["rms_q_by_joint"])[np.array(content["moving"])]
    away = 1e3 * float(np.sqrt(np.mean(rms**2)))
    return (
        f"Driven by the recorded torque, the simulated arm is {number(away)} mrad (rms over the"
        " joints that move) from where it was measured, on stretches of time that are left out;"
        f" {agree['within']} of {agree['of']} base parameters are within two standard errors of"
        " those by regression."
    )


def _errors(content: Content, labels: Sequence[str]) -> Table:
    rows = [
        ["all", *(number(1e3 * x) for x in content["rms_q_by_joint"])],
        ["stretches left out", *(number(1e3 * x) for x in content["held_out"]["rms_q_by_joint"])],
    ]
    caption = (
        "Rms of measured less simulated position. The recorded torque drives the arm; a weak spring"
        " and a damper keep it near the recorded one, so that errors do not add up."
    )
    return Table(caption, ["samples", *(f"{label} [mrad]" for label in labels)], rows)


def _positions(traces: Sequence[DrivenTrace], labels: Sequence[str]) -> list[Block]:
    caption = "Measured position, and that of the simulated arm; below, their difference."

    def figure(trace: DrivenTrace) -> Figure:
        charts, rows = [], []
        for j, label in enumerate(labels):
            measured, made = trace.measured[:, j], trace.simulated[:, j]
            models = {"simulated": (PREDICTED, made)}
            charts.append(beside_measured(label, trace.t, "position [rad]", measured, models))
            left = 1e3 * (measured - made)
            rows.append([label, number(float(left.std())), number(float(np.abs(left).max()))])
        table = Table("Measured less simulated.", ["joint", "rms [mrad]", "largest [mrad]"], rows)
        return Figure(Path(trace.name).name, caption, charts, table)

    return recording_figures(traces, figure)


def _compared(content: Content) -> list[Block]:
    agree = content["agreement"]
    rows = sorted(agree["base_parameters"], key=lambda r: -(r["apart"] or 0.0))
    cells = [
        [
            r["name"],
            r["unit"],
            plus_minus(r["simulation"], r["sd"]),
            plus_minus(r["regression"], r["regression_sd"]),
            number(r["apart"]),
        ]
        for r in rows[:_MOST_ROWS]
        if r["apart"] is not None
    ]
    text = (
        f"{agree['within']} of {agree['of']} base parameters are within two standard errors of"
        " each other. Regression forms accelerations of the recorded positions, simulation does"
        " not: where they differ, gears that give, coarse positions or late torque are likely."
    )
    heads = ["parameter", "unit", "simulation", "regression", "standard errors apart"]
    return [Text(text), Table("Those that are furthest apart.", heads, cells)]
