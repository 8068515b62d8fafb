"""Figures of a gap: maps over position and velocity, torque and motion over time."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ident.gap.results.forward_simulation import Forward
from ident.gap.results.held_out_error import BeforeAfter
from ident.gap.results.outcome import Search
from ident.report.figures import Series, torque_over_time
from ident.report.gap_page import RegionMap
from ident.report.page import Block, Gallery
from ident.report.style import MEASURED, PREDICTED, RESIDUAL
from ident.report.svg import Drawing

Array = NDArray[np.floating]

_CELLS = (24, 16)
_MOST_MAPS = 3
_MOST_JOINTS = 4


def maps(found: Search, both: BeforeAfter, joints: Sequence[int]) -> list[RegionMap]:
    """Rms residual over position and velocity of some joints, before and after."""
    rows = found.rows
    q = np.concatenate([rows.windows.mean(s.q) for s in rows.segments])
    qd = np.concatenate([rows.windows.mean(s.qd) for s in rows.segments])
    drawn = []
    for j in joints[:_MOST_MAPS]:
        edges = tuple(
            np.linspace(x[:, j].min(), x[:, j].max(), count + 1)
            for x, count in zip((q, qd), _CELLS, strict=True)
        )
        sides = [
            _rms(q[:, j], qd[:, j], (edges[0], edges[1]), side[j].values)
            for side in (both.before, both.after)
        ]
        drawn.append(RegionMap(j, edges[0], edges[1], sides[0], sides[1]))
    return drawn


def _rms(x: Array, y: Array, edges: tuple[Array, Array], values: Array) -> Array:
    count, _, _ = np.histogram2d(x, y, bins=list(edges))
    squares, _, _ = np.histogram2d(x, y, bins=list(edges), weights=values**2)
    return np.sqrt(np.where(count > 0, squares / np.maximum(count, 1), np.nan))


def torque_blocks(
    found: Search, both: BeforeAfter, joints: Sequence[int], labels: Sequence[str]
) -> list[Block]:
    """Torque of the first recording's joints over time, without and with the effects."""
    table = both.table
    log = np.array([s.log for s in found.rows.segments])[table.segment]
    order = np.flatnonzero(log == 0)
    order = order[np.argsort(table.t[order], kind="stable")]
    drawings: list[Drawing] = []
    for j in joints[:_MOST_JOINTS]:
        torque = table.columns[j][order, -1]
        for words, side in (("before", both.before), ("after", both.after)):
            predicted = torque - side[j].values[order]
            rms = float(np.sqrt(np.mean(side[j].values[order] ** 2)))
            series = Series(
                f"{labels[j]}, {words}",
                "N·m",
                table.t[order],
                torque,
                predicted,
                np.ones(len(order), dtype=bool),
                f"rms residual {rms:.3g}\u202fN·m",
            )
            drawings.append(torque_over_time(series))
    signs = [("measured", MEASURED), ("predicted", PREDICTED), ("residual", RESIDUAL)]
    caption = (
        "Torque of the first recording, measured and predicted, without the effect (left) and with"
        " it (right). Below each plot, what is left, on a scale of its own."
    )
    return [Gallery(drawings, caption, signs)] if drawings else []


def motion_blocks(
    before: Sequence[Forward],
    after: Sequence[Forward],
    joints: Sequence[int],
    labels: Sequence[str],
) -> list[Block]:
    """Motion of the first recording's joints, measured, and simulated without and with effects."""
    if not before or not after:
        return []
    drawings: list[Drawing] = []
    every = max(1, len(before[0].t) // 4000)
    for j in joints[:_MOST_JOINTS]:
        for words, run in (("before", before[0]), ("after", after[0])):
            measured, simulated = run.measured[::every, j], run.simulated[::every, j]
            rms = float(np.sqrt(np.mean((measured - simulated) ** 2)))
            series = Series(
                f"{labels[j]}, {words}",
                "rad",
                run.t[::every],
                measured,
                simulated,
                np.ones(len(measured), dtype=bool),
                f"rms error {1e3 * rms:.3g}\u202fmrad",
                "position",
            )
            drawings.append(torque_over_time(series))
    signs = [("measured", MEASURED), ("simulated", PREDICTED), ("difference", RESIDUAL)]
    caption = (
        "Motion of the first recording, measured and simulated in closed loop, without the effect"
        " (left) and with it (right). Below each plot, their difference, on a scale of its own."
    )
    return [Gallery(drawings, caption, signs)]
