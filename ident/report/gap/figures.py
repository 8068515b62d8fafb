"""Figures of a gap: each effect as a curve, what is left, torque and motion over time."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.effects.catalogue import catalogue
from ident.gap.data.blocks import HELD_OUT
from ident.gap.data.noise_regions import Region
from ident.gap.results.forward_simulation import ForwardSimulation
from ident.gap.results.held_out_error import BeforeAfter
from ident.gap.results.outcome import SearchResult
from ident.gap.selection.candidates import all_candidates
from ident.report.charts import Curve, Panel, line_chart, map_chart
from ident.report.figures import beside_measured
from ident.report.gap.effect_curve import (
    OWN_TORQUE,
    EffectCurve,
    effect_curve,
    motion_of,
    units_of,
)
from ident.report.page import Block, Figure, Table
from ident.report.style import BLUE, ORANGE, WITH, WITHOUT, Sign
from ident.report.words import number
from ident.signals.arrays import Array
from wamctl.arm.joint_labels import joints_text

_CELLS = (24, 16)
_MOST_JOINTS = 4


def effect_figures(
    found: SearchResult, both: BeforeAfter, labels: Sequence[str]
) -> tuple[list[Figure], list[str]]:
    """Of each effect that was taken in: its torque over what it depends on; where it acts most."""
    figures, acts = [], []
    for i, effect in enumerate(found.verdict.effects):
        curves = {labels[j]: effect_curve(found, both, i, j) for j in effect.joints[:_MOST_JOINTS]}
        figures.append(_effect(curves))
        title = catalogue()[effect.candidate.effect].title
        acts += [
            f"{title[0].upper()}{title[1:]}, {joints_text([label])}: {c.where}."
            for label, c in curves.items()
            if c.where
        ]
    return figures, acts


def _effect(curves: Mapping[str, EffectCurve]) -> Figure:
    charts, rows = [], []
    said = " and ".join(dict.fromkeys(c.variable for c in curves.values()))
    for label, c in curves.items():
        torque = [
            Curve("two thirds of the samples", Sign(ORANGE, "band"), np.stack([c.low, c.high])),
            Curve("the effect", Sign(BLUE), c.effect),
            Curve("measured", Sign(ORANGE, "circle"), c.measured),
        ]
        left = [Curve("without the effect", WITHOUT, c.before), Curve("with it", WITH, c.after)]
        panels = [
            Panel(f"torque [{c.unit}]", torque),
            Panel(f"rms residual [{c.unit}]", left, height=125),
        ]
        charts.append(line_chart(label, (c.variable, c.x), panels, joint=label))
        cells = zip(c.x, c.effect, c.measured, c.before, c.after, strict=True)
        rows += [[label, *(number(float(v)) for v in cell)] for cell in cells]
    over = "No single quantity draws this effect as a curve, so its torque is drawn over itself"
    if said != OWN_TORQUE:
        over = f"Torque of the effect over {said.partition(' [')[0]}"
    caption = (
        f"{over}, beside the measured torque minus everything else in the model, while the joint"
        " slides (averages). Lower panel: the residual at the same place, without the effect and"
        " with it."
    )
    unit = " or ".join(dict.fromkeys(c.unit for c in curves.values()))
    named = ("the effect", "measured", "rms without", "rms with")
    quantities = [f"{name} [{unit}]" for name in named]
    table = Table("The effect, point by point.", ("joint", said, *quantities), rows)
    return Figure("The effect as a curve", caption, charts, table)


def reversals(both: BeforeAfter) -> Array:
    """Rms residual on held-out data while a joint stands still or turns round [N m], (2, n)."""
    kept = both.design.fold == HELD_OUT
    rms = np.full((2, len(both.after)), np.nan)
    for i, side in enumerate((both.before, both.after)):
        for j, r in enumerate(side):
            turning = r.values[kept & (r.region == Region.REVERSAL)] if len(r.values) else r.values
            rms[i, j] = np.sqrt(np.mean(turning**2)) if len(turning) else np.nan
    return rms


def sizes_of(found: SearchResult) -> dict[str, tuple[str, str]]:
    """Name and unit of the coefficient that is an effect's size, by effect."""
    first = {h.effect: h.coefficients[0] for h in reversed(all_candidates(found.end.model.facts))}
    return {name: (c.name, c.unit) for name, c in first.items()}


def left_figure(
    found: SearchResult, both: BeforeAfter, joints: Sequence[int], labels: Sequence[str]
) -> list[Block]:
    """Rms residual over position and velocity of some joints, as it is left."""
    q, qd = motion_of(found)[:2]
    charts, rows = [], []
    for j in joints[:_MOST_JOINTS]:
        edges = tuple(
            np.linspace(x[:, j].min(), x[:, j].max(), count + 1)
            for x, count in zip((q, qd), _CELLS, strict=True)
        )
        cells = _rms(q[:, j], qd[:, j], (edges[0], edges[1]), both.after[j].values)
        most = float(np.nanmax(cells))
        torque, way = units_of(found, j)
        axes = (f"position [{way}]", f"velocity [{way}/s]")
        charts.append(map_chart(labels[j], axes, (edges[0], edges[1]), cells, most))
        rows.append([labels[j], torque, number(float(np.nanmedian(cells))), number(most)])
    if not charts:
        return []
    caption = "Rms residual over position and velocity: darker is larger, white has no data."
    table = Table("Rms residual of the cells.", ("joint", "unit", "median", "largest"), rows)
    return [Figure("What is left", caption, charts, table)]


def _rms(x: Array, y: Array, edges: tuple[Array, Array], values: Array) -> Array:
    count, _, _ = np.histogram2d(x, y, bins=list(edges))
    squares, _, _ = np.histogram2d(x, y, bins=list(edges), weights=values**2)
    return np.sqrt(np.where(count > 0, squares / np.maximum(count, 1), np.nan))


def torque_figure(
    found: SearchResult, both: BeforeAfter, joints: Sequence[int], labels: Sequence[str]
) -> list[Block]:
    """Torque of the first recording's joints over time, without and with the effects."""
    design = both.design
    log = found.rows.log
    order = np.flatnonzero(log == 0)
    order = order[np.argsort(design.t[order], kind="stable")]
    runs = []
    for j in joints[:_MOST_JOINTS]:
        torque = design.columns[j][order, -1]
        sides = [torque - side[j].values[order] for side in (both.before, both.after)]
        turning = both.after[j].region[order] == Region.REVERSAL
        runs.append((labels[j], design.t[order], [torque, *sides], turning))
    named = bool(found.end.accepted)
    caption = (
        f"First recording: measured torque and the model's{_below(named)} Grey: the"
        " joint stands still or turns round, where the residual may leave the panel; zoom in to"
        f" see it there.{_some(runs, joints)}"
    )
    return _over_time("Torque of the joints", caption, "torque [N·m]", runs, named)


def motion_figure(
    before: Sequence[ForwardSimulation],
    after: Sequence[ForwardSimulation],
    joints: Sequence[int],
    labels: Sequence[str],
) -> list[Block]:
    """Motion of the first recording's joints, measured, and simulated without and with effects."""
    if not before or not after:
        return []
    old, new = before[0], after[0]
    runs = [
        (labels[j], old.t, [r[:, j] for r in (old.measured, old.simulated, new.simulated)], None)
        for j in joints[:_MOST_JOINTS]
    ]
    named = new is not old
    caption = (
        "First recording: measured motion, and the closed loop of controller and model simulated"
        f" along the wanted motion{_below(named)}{_some(runs, joints)}"
    )
    return _over_time("Motion of the joints", caption, "position [rad]", runs, named)


def _below(named: bool) -> str:
    return f"; below, the residual{', on one scale for both models' if named else ''}."


def _some(runs: Sequence[Any], joints: Sequence[int]) -> str:
    return f" {len(runs)} of {len(joints)} joints are drawn." if len(runs) < len(joints) else ""


_Run = tuple[str, Array, list[Array], NDArray[np.bool_] | None]


def _over_time(
    title: str, caption: str, quantity: str, runs: Sequence[_Run], named: bool
) -> list[Block]:
    """Measured and modelled curves, and their difference; two models if something was named."""
    sides = {"without the effects": WITHOUT, "with them": WITH} if named else {"model": WITH}
    charts, rows = [], []
    for label, t, (measured, *modelled), turning in runs:
        curves = {name: (sign, y) for (name, sign), y in zip(sides.items(), modelled, strict=False)}
        lefts = [measured - y for _, y in curves.values()]
        reach = None
        if turning is not None and not turning.all():
            reach = max(float(np.abs(left[~turning]).max()) for left in lefts)
        charts.append(
            beside_measured(label, t, quantity, measured, curves, shaded=turning, reach=reach)
        )
        rows.append([label, *(number(float(np.sqrt(np.mean(left**2)))) for left in lefts)])
    unit = quantity[quantity.index("[") :]
    heads = ["joint", *(f"rms residual, {name} {unit}" for name in sides)]
    table = Table("Over the whole first recording, standstill and reversals included.", heads, rows)
    return [Figure(title, caption, charts, table)] if charts else []
