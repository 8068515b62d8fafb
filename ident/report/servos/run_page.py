"""Pages of identification and validation by simulation: positions, not torques."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ident.output_error.setup import MotionSegment
from ident.report.charts import Chart
from ident.report.figures import beside_measured, recording_figures
from ident.report.page import Block, Figure, Page, Section, Status, Step, Table, Verdict, table_of
from ident.report.provenance_section import provenance_section
from ident.report.style import PREDICTED, Sign
from ident.report.words import Content, number, plus_minus
from ident.signals.arrays import Array
from wamctl.arm.joint_labels import joint_labels

_COMMANDED = Sign("#b0b0b0", "line")
_TRUST: dict[str, tuple[Status, str]] = {
    "trustworthy": ("good", "trustworthy"),
    "doubtful": ("warning", "doubtful"),
}


@dataclass(frozen=True)
class ServoTrace:
    """One unbroken recording.

    Attributes:
        name: of the log.
        t: time [s], shape (S,).
        commanded, measured, simulated: [rad], shape (S, n) each.
    """

    name: str
    t: Array
    commanded: Array
    measured: Array
    simulated: Array

    @classmethod
    def of(cls, segment: MotionSegment, simulated: Array) -> "ServoTrace":
        """A recording beside its simulation."""
        m = segment.motion
        held = np.maximum(np.searchsorted(m.stamp, m.t, side="right") - 1, 0)
        return cls(segment.name, m.t, m.command[held], segment.q, simulated)


def servo_page(command: str, content: Content, traces: Sequence[ServoTrace]) -> Page:
    """The page of a run, or of a validation, by simulation."""
    labels = joint_labels(content["joints"])
    whole_rms = _whole(content, content["rms_q_by_joint"])
    sections = [
        Section("How well the simulation follows", [_error_table(content, labels)]),
        Section("Measured and simulated positions", _positions(traces, labels)),
    ]
    if "parameters" in content:
        sections[1:1] = [
            Section("Servo, friction, and gears", [_parameters(content, labels)]),
            Section("What was tried", [_tried(content, labels)]),
        ]
    return Page(
        command=command,
        title=f"{content['arm']}: positions simulated from commands",
        verdict=_verdict(content),
        figures=[(f"{1e3 * whole_rms:.2f} mrad", "rms position error of the joints that move")],
        sections=[*sections, provenance_section(content)],
        steps=_steps(content),
    )


def error_sentence(content: Content) -> str:
    """How far the simulated arm is from the measured one."""
    rms = 1e3 * _whole(content, content["rms_q_by_joint"])
    if "held_out" not in content:
        return (
            f"Simulated in closed loop from the commands alone, the model is {rms:.2f} mrad"
            " (rms over the joints that move) from where the arm was measured."
        )
    away = 1e3 * _whole(content, content["held_out"]["rms_q_by_joint"])
    return (
        f"Simulated in closed loop from the commands alone, the arm is {rms:.2f} mrad (rms over"
        " the joints that move) from where it was measured, and"
        f" {away:.2f} mrad on stretches of time that are left out."
    )


def _whole(content: Content, rms_by_joint: Sequence[float]) -> float:
    """Over the joints that move: the others keep away from their commands, and are not fitted."""
    return float(np.sqrt(np.mean(np.square(rms_by_joint)[np.array(content["moving"])])))


def _verdict(content: Content) -> Verdict:
    status, word = _TRUST.get(content["verdict"], ("bad", content["verdict"]))
    if "held_out" not in content:
        status, word = "open", "error on new data"
    told = [r["sentence"] for r in content["remarks"]]
    return Verdict(status, word, error_sentence(content), told)


def _error_table(content: Content, labels: Sequence[str]) -> Table:
    heads = ["recording", *(f"{label} [mrad]" for label in labels)]
    rows = [
        [Path(log["name"]).name, *(number(1e3 * x) for x in log["rms_q_by_joint"])]
        for log in content["logs"]
    ]
    rows.append(["all", *(number(1e3 * x) for x in content["rms_q_by_joint"])])
    if "held_out" in content:
        held = content["held_out"]["rms_q_by_joint"]
        rows.append(["stretches left out", *(number(1e3 * x) for x in held)])
    away = content["following_rms_by_joint"]
    rows.append(["command less position", *(number(1e3 * x) for x in away)])
    return Table("Rms of measured less simulated position.", heads, rows)


def _parameters(content: Content, labels: Sequence[str]) -> Table:
    names = list(dict.fromkeys(p["name"] for p in content["parameters"]))
    rows = []
    for name in names:
        mine = {p["joint"]: p for p in content["parameters"] if p["name"] == name}
        first = next(iter(mine.values()))
        cells = [
            plus_minus(mine[j]["value"], mine[j]["sd"]) if j in mine else ""
            for j in range(1, len(labels) + 1)
        ]
        rows.append([f"{name.replace('_', ' ')}: {first['meaning']}", first["unit"], *cells])
    lost = ["lost motion: Coulomb friction over stiffness", "rad"]
    rows.append([*lost, *(number(x) for x in content["lost_motion_rad"])])
    caption = (
        "Settings with standard errors; empty: not fitted, none of it. A torque limit or a planned"
        " speed or acceleration that is empty was not reached by this motion. All torques are as"
        " right as the URDF's masses, which stay as they are."
    )
    return Table(caption, ("what", "unit", *labels), rows)


def _tried(content: Content, labels: Sequence[str]) -> Table:
    rows = [
        [
            trial["name"].replace("_", " "),
            *(
                number(gain) + ("\u202fkept" if kept else "")
                for gain, kept in zip(trial["gain_by_joint"], trial["kept"], strict=True)
            ),
        ]
        for trial in content["parts_tried"]
    ]
    caption = (
        "Logarithm of the ratio of errors without and with each part, on stretches of time that"
        " are left out; 0.03 is 3 % smaller. What the others explain at once is not tried."
    )
    return Table(caption, ("part", *labels), rows)


def _positions(traces: Sequence[ServoTrace], labels: Sequence[str]) -> list[Block]:
    caption = "Command, measured position, and the simulation, which knows the command alone."
    cells: dict[str, Callable[[tuple[str, Array]], str]] = {
        "joint": lambda e: e[0],
        "rms [mrad]": lambda e: number(1e3 * float(np.sqrt(np.mean(e[1] ** 2)))),
        "largest [mrad]": lambda e: number(1e3 * float(np.abs(e[1]).max())),
    }

    def figure(trace: ServoTrace) -> Figure:
        left = zip(labels, (trace.measured - trace.simulated).T, strict=True)
        charts = [_chart(trace, j, label) for j, label in enumerate(labels)]
        table = table_of("Measured less simulated.", left, cells)
        return Figure(Path(trace.name).name, caption, charts, table)

    return recording_figures(traces, figure)


def _chart(trace: ServoTrace, j: int, label: str) -> Chart:
    commanded = {"commanded": (_COMMANDED, trace.commanded[:, j])}
    simulated = {"simulated": (PREDICTED, trace.simulated[:, j])}
    measured = trace.measured[:, j]
    return beside_measured(label, trace.t, "position [rad]", measured, simulated, beside=commanded)


def _steps(content: Content) -> list[Step]:
    return [
        Step(
            "Test the model on a recording that it was not fitted on:",
            ["ident", "validate", "OTHER.mcap", "--model", content.get("model", "model.yaml")],
        ),
        Step(
            "Use the arm in MuJoCo:",
            ["ident", "export", "model.yaml", "--to", "mjcf", "--out", "arm.xml"],
        ),
    ]
