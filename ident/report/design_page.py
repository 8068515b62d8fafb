"""The page of `ident design`: the motion, what it promises, and how much of each limit it uses."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ident.report.charts import Curve, Panel, kept_samples, line_chart
from ident.report.figures import row_figure
from ident.report.page import Block, Figure, Page, Section, Step, Table, Verdict, table_of
from ident.report.provenance_section import provenance_section
from ident.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, Sign
from ident.report.words import number, percent, setting, unit_text, whole
from ident.signals.arrays import Array
from wamctl.arm.trajectory import Trajectory
from wamctl.arm.trajectory_check import Quantity

_SIGNS = (
    Sign(BLUE, "circle"),
    Sign(ORANGE, "diamond"),
    Sign(GREEN, "triangle"),
    Sign(GREY, "square"),
    Sign(BLACK, "ring"),
    Sign(PURPLE, "down"),
)
_NEAREST = 8


@dataclass(frozen=True)
class DesignReport:
    """What the page is made of.

    Attributes:
        arm: its name.
        trajectory: the motion with its promise.
        quantities: all that is limited, along one period.
        t: times of those samples, shape (S,) [s].
        content: `seconds` and `provenance`, where there are any.
        files: the arm's file and the trajectory's, as commands take them.
    """

    arm: str
    trajectory: Trajectory
    quantities: Sequence[Quantity]
    t: Array
    content: Mapping[str, Any]
    files: tuple[str, str] = ("ARM.yaml", "trajectory.yaml")

    def per_joint(self, unit: str | None = None) -> list[Quantity]:
        """What each joint or motor has, perhaps only what is measured in one unit."""
        n = len(self.trajectory.series.joint_names)
        bounded = [
            q for q in self.quantities if len(q.subjects) == n and np.isfinite(q.upper).all()
        ]
        return [q for q in bounded if unit in (None, q.unit)]

    @property
    def distance(self) -> Quantity | None:
        """Distances between bodies."""
        found = [q for q in self.quantities if np.isinf(q.upper).any() and q.values.size]
        return found[0] if found else None


def used_share(quantity: Quantity) -> Array:
    """Largest part of the way from the middle of the range to its end, shape (m,) [%]."""
    middle = (quantity.lower + quantity.upper) / 2
    half = (quantity.upper - quantity.lower) / 2
    return 100 * np.abs((quantity.values - middle) / half).max(axis=0)


def design_page(report: DesignReport) -> Page:
    """The page of a designed excitation."""
    sections = [
        Section("The motion", _motion(report)),
        Section("How much of each limit it uses", _shares(report)),
        Section("Motor torque", _torque(report)),
        Section("Speed of elbow and tool", _speed(report)),
        Section("Distance between the arm's bodies", _distance(report)),
        provenance_section(report.content),
    ]
    config, file = report.files
    return Page(
        command="ident design",
        title=f"{report.arm}: excitation trajectory",
        verdict=_verdict(report),
        figures=_figures(report),
        sections=[s for s in sections if s.blocks],
        steps=[
            Step(
                "See the arm move along it:",
                ["ident", "design", "--config", config, "--start", file, "--view"],
            ),
            Step(
                "Run it; the arm moves only after you confirm with its name:",
                ["wamctl", "excite", "--config", config, "--trajectory", file],
            ),
            Step("Then identify the arm:", ["ident", "run", "LOG.mcap"]),
        ],
    )


def _verdict(report: DesignReport) -> Verdict:
    promise = report.trajectory.promise
    worst = max((float(used_share(q).max()), q.name) for q in report.per_joint())
    if "shows" in promise:
        sentence = f"A motion that makes one effect visible: {promise['shows']}."
    else:
        sentence = (
            f"A motion that shows {promise.get('parameters', 'the')} base parameters with a"
            f" condition number of {number(promise.get('condition_number'))}."
        )
    passed = [q.name for q in report.quantities if _passes(q)]
    kept = not passed
    more = [
        "It keeps every limit of the design."
        if kept
        else f"It passes limits of the design: {', '.join(passed)}.",
        f"Of the joints and motors, the {worst[1]} comes closest to its limit, with"
        f" {percent(worst[0])} of what is allowed.",
    ]
    if report.distance is not None:
        least = float(report.distance.values.min())
        more.append(f"No two bodies come closer than {number(least)}\u202fm.")
    return Verdict(
        "good" if kept else "bad", "ready to run" if kept else "not allowed", sentence, more
    )


def _passes(quantity: Quantity) -> bool:
    values = quantity.values
    return bool(((values < quantity.lower) | (values > quantity.upper)).any())


def _figures(report: DesignReport) -> list[tuple[str, str]]:
    trajectory = report.trajectory
    series = trajectory.series
    condition = trajectory.promise.get("condition_number")
    seen = [
        (number(condition), "condition number of W"),
        (str(trajectory.promise.get("parameters", "–")), "base parameters"),
    ]
    return [
        *(seen if condition is not None else []),
        (f"{number(series.period_s)}\u202fs", f"a period, {trajectory.periods} of which count"),
        (whole(series.harmonics), f"harmonics of {setting(series.fundamental_rad_s)}\u202frad/s"),
    ]


def _over_time(quantity: Quantity, t: Array, caption: str) -> Figure:
    label = f"{quantity.name} [{unit_text(quantity.unit)}]"
    charts, rows = [], []
    for k, subject in enumerate(quantity.subjects):
        values = quantity.values[:, k]
        limits = [float(b[k]) for b in (quantity.lower, quantity.upper) if np.isfinite(b[k])]
        kept = kept_samples(values)
        panel = Panel(label, [Curve("planned", Sign(BLUE), values[kept])], 150, limits)
        charts.append(line_chart(subject, ("time [s]", t[kept]), [panel], joint=subject))
        ends = (values.min(), values.max(), quantity.lower[k], quantity.upper[k])
        rows.append([subject, *(number(float(x)) for x in ends)])
    heads = ("joint, motor, or point", "least", "most", "lower limit", "upper limit")
    title = f"{quantity.name.capitalize()} over one period"
    caption = f"{caption} Dashed: the limits of the design."
    return Figure(title, caption, charts, Table(f"{label} over one period.", heads, rows))


def _motion(report: DesignReport) -> list[Block]:
    caption = "Position of each joint over one period; the motion repeats from its end."
    return [
        _over_time(q, report.t, caption) for q in report.per_joint("rad") if q.name == "position"
    ]


def _torque(report: DesignReport) -> list[Block]:
    caption = "Torque that one period asks of each motor, friction included, by the CAD model."
    return [_over_time(q, report.t, caption) for q in report.per_joint("N m")]


def _speed(report: DesignReport) -> list[Block]:
    caption = "Speed of elbow and tool over one period."
    speeds = [q for q in report.quantities if q.name == "speed"]
    unsigned = [replace(q, lower=np.full_like(q.lower, -np.inf)) for q in speeds]
    return [_over_time(q, report.t, caption) for q in unsigned]


def _shares(report: DesignReport) -> list[Block]:
    found = report.per_joint()
    rows = [f"joint or motor {k + 1}" for k in range(len(report.trajectory.series.joint_names))]
    values = {
        q.name: (sign, used_share(q).tolist()) for q, sign in zip(found, _SIGNS, strict=False)
    }
    caption = (
        "Largest use of each limit over one period, from the middle of its range (0 %) to its end"
        " (100 %). Torque and its slew belong to motors, all else to joints."
    )
    title, quantity = "Share of each limit that the motion uses", "share of the limit [%]"
    return [row_figure(title, caption, quantity, rows, values, head="joint or motor")]


def _distance(report: DesignReport) -> list[Block]:
    quantity = report.distance
    if quantity is None:
        return []
    nearest = np.argsort(quantity.values.min(axis=0))[:_NEAREST]
    least = quantity.values.min(axis=1)
    kept = kept_samples(least)
    curve = Curve("planned", Sign(BLUE), least[kept])
    panel = Panel("distance [m]", [curve], 150, [float(quantity.lower.max())])
    title = "Distance of the nearest two bodies"
    chart = line_chart(title, ("time [s]", report.t[kept]), [panel])
    cells: dict[str, Callable[[int], str]] = {
        "bodies": lambda k: quantity.subjects[k],
        "least distance [m]": lambda k: number(float(quantity.values[:, k].min())),
        "at least [m]": lambda k: number(float(quantity.lower[k])),
    }
    caption = (
        "Whichever two bodies are nearest, over one period. Dashed: the least that is allowed."
    )
    followed = f"The nearest pairs of the {len(quantity.subjects)} followed."
    table = table_of(followed, nearest.tolist(), cells)
    return [Figure(title, caption, [chart], table)]
