"""An arm's own page: each parameter over time, with its band, changes and events."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from urllib.parse import quote

import numpy as np
from markupsafe import Markup

from ident.fleet.series import ArmResult, Entry, Series
from ident.report.charts import Chart, Curve, Panel, line_chart
from ident.report.fleet.words import change_text, day, rivals_text
from ident.report.page import Block, Figure, Page, Points, Section, Table, Text, Verdict, table_of
from ident.report.style import BLUE, GREY, VERMILION, Sign
from ident.report.words import Content, number, plus_minus, setting, unit_text
from ident.signals.arrays import Array
from wamctl.arm.joint_labels import joint_labels

_DAY_NS = 86_400e9
_LN_10 = 2.302585
_NO_EFFECT = (
    "No effect came that the arm's model lacks: what has changed are numbers that it holds, such as"
    " its friction."
)
_KINDS = {
    "Dry friction": ("fc", "fcm"),
    "Viscous friction": ("fv", "fvm"),
    "Friction at low speed": ("stribeck",),
    "Torque offset": ("fo",),
    "Joint zero": ("zero",),
    "Rotor inertia": ("ia",),
    "Links": ("inertial",),
}


def arm_page(series: Series, result: ArmResult, changes: Sequence[Content]) -> Page:
    """The page of one arm.

    Args:
        series: its logs.
        result: what is said of it.
        changes: of `changes.json`, this arm's.
    """
    labels = joint_labels(series.kind.joints)
    t = np.array([(e.time_ns - series.entries[0].time_ns) / _DAY_NS for e in series.entries])
    onset = float(t[result.changes[0].onset]) if result.changes else None
    asked = changes[0].get("gap") if changes else None
    sections = [
        *([Section("What the first change is", _searched(asked))] if asked else []),
        Section("Odds of a change", [_odds(result, t, series.least_odds, onset)]),
        *(
            Section(heading, [block], folded=heading == "Links")
            for heading, kinds in _KINDS.items()
            for block in _parameters(series, result, t, kinds, heading, onset)
        ),
        Section("Events and logs", _events(series.entries)),
    ]
    first, last = (e.stored.source.address for e in (series.entries[0], series.entries[-1]))
    figures = [(str(len(series.entries)), "logs"), (setting(round(float(t[-1]), 1)), "days")]
    verdict = _verdict(changes, labels, f"from {first} to {last}")
    return Page("ident fleet", series.arm, verdict, figures, sections)


def _verdict(changes: Sequence[Content], labels: Sequence[str], logs: str) -> Verdict:
    if not changes:
        return Verdict("good", "no change", f"No change was found in its logs, {logs}.")
    first, *others = (
        f"{change_text(c, labels)}, since {day(c['since'])}.{rivals_text(c)}" for c in changes
    )
    return Verdict("warning", "changed", first[:1].upper() + first[1:], others)


def _searched(asked: Content) -> list[Block]:
    """What `ident gap` says of the logs after the first change."""
    if asked["report"] is None:
        return [Text(f"The missing effect could not be searched: {asked['sentences'][0]}")]
    before, after = asked["logs"]
    how = (
        f"By ident gap on the first {after} logs after the change, beside a model of the last"
        f" {before} before it."
    )
    link = Markup('<a href="../{}">The report of the search</a>').format(quote(asked["report"]))
    said = [_NO_EFFECT] if asked["verdict"] == "no_gap" else asked["sentences"]
    return [Points(said), Text(how), Text(link)]


def _odds(result: ArmResult, t: Array, least: float, onset: float | None) -> Figure:
    odds = np.where(np.isfinite(result.log_odds), result.log_odds, np.nan) / _LN_10
    limits = [least / _LN_10] if np.isfinite(least) else []
    panel = Panel("powers of ten", [Curve("odds", Sign(BLUE), odds, points=True)], limits=limits)
    chart = line_chart("Odds", ("days since the first log", t), [panel], at=onset)
    rows = [[setting(round(float(x), 2)), number(float(y))] for x, y in zip(t, odds, strict=True)]
    caption = (
        "Odds of any change against none, after each log. Dashed line: from here on a change is"
        " told. Vertical line: where it began."
    )
    return Figure("Odds", caption, [chart], Table("Odds.", ("days", "odds, powers of ten"), rows))


def _parameters(
    series: Series,
    result: ArmResult,
    t: Array,
    kinds: Sequence[str],
    heading: str,
    onset: float | None,
) -> list[Block]:
    """A figure with a chart for each parameter of some kinds; none where there is none."""
    labels = joint_labels(series.kind.joints)
    places = series.kind.of_kinds(*kinds)
    if not places:
        return []
    charts = [_chart(series, result, t, k, labels, onset) for k in places]
    known, names = series.known, series.kind.names
    cells: dict[str, Callable[[int], str]] = {
        "parameter": lambda k: names[k].text,
        "now (± standard error)": lambda k: plus_minus(
            float(result.levels[-1, k]), float(result.level_sds[-1, k])
        ),
        "mean of its type": lambda k: number(float(known.mean[k])),
        "spread in its type": lambda k: number(float(known.D[k] ** 0.5), 2),
        "unit": lambda k: unit_text(names[k].unit),
    }
    caption = (
        "Points: each log alone, with what the type knows beforehand, brought to"
        f" {setting(known.reference_c)} °C, and a band of two standard errors. Line: all logs up to"
        " there together. Grey: the mean of the type. Grey ground: other firmware or tool than in"
        " the first log. Vertical line: the first change."
    )
    table = table_of("After the last log.", places, cells)
    return [Figure(heading, caption, charts, table)]


def _chart(
    series: Series,
    result: ArmResult,
    t: Array,
    place: int,
    labels: Sequence[str],
    onset: float | None,
) -> Chart:
    name, known = series.kind.names[place], series.known
    alone, sd = result.at_reference[:, place], result.sds[:, place]
    curves = [
        Curve(
            "two standard errors", Sign(BLUE, "band"), np.stack([alone - 2 * sd, alone + 2 * sd])
        ),
        Curve("type", Sign(GREY, dash=(4, 3)), np.full(len(t), known.mean[place])),
        Curve("log alone", Sign(BLUE, "circle"), alone),
        Curve("all logs so far", Sign(VERMILION), result.levels[:, place]),
    ]
    panel = Panel(f"{name.text} [{unit_text(name.unit)}]", curves, height=150)
    over = ("days since the first log", t)
    shaded = _other_spans(series.entries, t)
    return line_chart(
        name.text, over, [panel], at=onset, shaded=shaded, joint=labels[name.joint - 1]
    )


def _other_spans(entries: Sequence[Entry], t: Array) -> list[tuple[float, float]]:
    """Spans of time with another firmware or tool than in the first log."""
    first = (entries[0].firmware, entries[0].tool)
    spans: list[tuple[float, float]] = []
    for k, entry in enumerate(entries):
        if (entry.firmware, entry.tool) == first:
            continue
        begin, end = float(t[max(k - 1, 0)]), float(t[k])
        joined = spans and spans[-1][1] >= begin
        spans[-1:] = [(spans[-1][0], end)] if joined else [*spans[-1:], (begin, end)]
    return spans


def _events(entries: Sequence[Entry]) -> list[Block]:
    events = []
    for before, after in pairwise(entries):
        for what in ("firmware", "tool"):
            old, new = getattr(before, what), getattr(after, what)
            if old != new:
                name = after.stored.source.address
                events.append(f"{what} {old or 'unknown'} became {new or 'unknown'} with {name}.")
    said = [
        f"{e.stored.source.address}: {sentence}"
        for e in entries
        for _, sentence in e.stored.reduced.remarks
    ]
    blocks: list[Block] = [Points(events) if events else Text("Firmware and tool stayed the same.")]
    return [*blocks, Points(said[:50])] if said else blocks
