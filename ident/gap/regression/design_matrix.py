"""From segments to inner products: nominal columns, reversal curves, and candidates."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.compiled_regressor import regressor
from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.effects.observation import ArmFacts, Observed
from ident.effects.observing import CurrentModel, observed
from ident.effects.reversal_friction import BASIS
from ident.effects.smoothed_segment import SmoothedSegment
from ident.gap.data.noise_regions import Region, regions
from ident.gap.data.reference_model import Known
from ident.gap.data.windows import Windows, body_step
from ident.gap.regression.normal_equations import Layout, NormalEquations, joint_products
from ident.gap.regression.weighted_fit import ColumnIndex

Array = NDArray[np.floating]

FOLDS = 3
EXCLUDED = -1
"""Fold of the rows that stand apart."""

_ABSENT = 1e-12  # a base column this small beside the joint's torque is rounding


@dataclass(frozen=True)
class WindowedRows:
    """Rows that do not depend on the present model.

    Attributes:
        segments: the samples.
        windows: of the rows.
        kept: the inertial parameters that the base columns stand for, shape (b,).
        base: windowed base columns, per segment, shape (R, n, b).
        turnings: windowed reversal curves, per segment, shape (R, n, T).
        viscous, torque: per segment, shape (R, n).
        least: error that a trusted model brings [N m], shape (n,), or None.
        apart: rows that no fit may see, shape (R,), or None.
        formed: windowed columns of hypotheses that later models can use again.
    """

    segments: tuple[SmoothedSegment, ...]
    windows: Windows
    kept: NDArray[np.int64]
    base: tuple[Array, ...]
    turnings: tuple[Array, ...]
    viscous: tuple[Array, ...]
    torque: tuple[Array, ...]
    least: Array | None = None
    apart: NDArray[np.bool_] | None = None
    formed: dict[tuple[object, ...], Array] = field(default_factory=dict, repr=False)


@dataclass(frozen=True)
class Table:
    """All rows, as inner products, and where each hypothesis' columns stand.

    Attributes:
        grams: inner products.
        slots: columns of each hypothesis, by its number.
        hypotheses: what the candidate columns stand for.
        columns: per joint, shape (R, p), in the order of its layout.
        fold: of each row, shape (R,).
        region: of each row and joint, shape (R, n).
        segment: of each row, shape (R,).
        t: time of each row since its recording's start [s], shape (R,).
    """

    grams: NormalEquations
    slots: dict[int, ColumnIndex]
    hypotheses: tuple[Candidate, ...]
    columns: tuple[Array, ...]
    fold: NDArray[np.int64]
    region: NDArray[np.int64]
    segment: NDArray[np.int64]
    t: Array

    def searched(self, folds: Sequence[int]) -> "Table":
        """The same with the inner products of some folds, taken together."""
        return replace(self, grams=self.grams.of(folds))


def windowed_rows(
    parts: Sequence[SmoothedSegment],
    windows: Windows,
    facts: ArmFacts,
    kept: NDArray[np.int64],
    known: tuple[Known, Array] | None = None,
) -> WindowedRows:
    """The rows of the rigid-body model with friction.

    Args:
        parts: the samples.
        windows: of the rows.
        facts: of the arm.
        kept: base inertial parameters, to be fitted.
        known: of a trusted model: its torque [N m], shape (S, n), which is taken off the measured
            one, and its error [N m], shape (n,).
    """
    every = body_step(windows)
    coarse = windows.coarser(every)
    base, turnings = [], []
    for s in parts:
        still = np.where(facts.moving, 1.0, 0.0)
        middle = slice(every // 2, None, every)
        motion = (s.q[middle], s.qd[middle] * still, s.qdd[middle] * still)
        columns = regressor(facts.chain, *(np.ascontiguousarray(m) for m in motion))[:, :, kept]
        base.append(coarse.mean(columns))
        turnings.append(_turning_columns(s, windows))
    return WindowedRows(
        tuple(parts),
        windows,
        kept,
        tuple(base),
        tuple(turnings),
        tuple(windows.mean(s.qd) for s in parts),
        tuple(windows.mean(s.tau if known is None else s.tau - known[0](s)) for s in parts),
        None if known is None else known[1],
    )


def _turning_columns(s: SmoothedSegment, windows: Windows) -> Array:
    joints = range(s.q.shape[1])
    return np.stack(
        [
            windows.mean(np.stack([t(s.q[:, j], s.speeds[..., j]) for j in joints], axis=-1))
            for t in BASIS
        ],
        axis=-1,
    )


def build_design_matrix(
    rows: WindowedRows,
    model: CurrentModel,
    accepted: Sequence[Candidate],
    candidates: Sequence[Candidate] = (),
) -> Table:
    """Inner products of the model's columns, and of each candidate's with them.

    Args:
        rows: what does not depend on the model.
        model: what columns of effects are formed with.
        accepted: effects that are in the model together.
        candidates: effects of which at most one is looked at in any fit.
    """
    dof = model.facts.dof
    hypotheses = [*accepted, *candidates]
    slots, widths = _slots(hypotheses, dof)
    extras = [
        _extra_columns(rows, model, hypotheses, slots, widths, i) for i in range(len(rows.segments))
    ]
    region = np.concatenate(
        [
            regions(s.speeds[1], model.slow, model.facts.motor_from_joint, rows.windows)
            for s in rows.segments
        ]
    )
    lengths = [len(t) for t in rows.torque]
    fold = np.repeat([s.fold for s in rows.segments], lengths)
    if rows.apart is not None:
        fold[rows.apart] = EXCLUDED
    segment = np.repeat(np.arange(len(lengths)), lengths)
    base, turnings = np.concatenate(rows.base), np.concatenate(rows.turnings)
    viscous, torque = np.concatenate(rows.viscous), np.concatenate(rows.torque)
    layouts, products, counts, kept = [], [], [], []
    for j in range(dof):
        extra = np.concatenate([e[j] for e in extras])
        present = np.abs(base[:, j]).max(axis=0) > _ABSENT
        where = np.flatnonzero(present)
        columns = np.column_stack(
            [base[:, j, where], viscous[:, j], turnings[:, j], extra, torque[:, j]]
        )
        if not model.facts.moving[j]:
            columns = columns[:0]
        use = slice(None) if len(columns) else slice(0)
        layout = Layout(where, turnings.shape[2], extra.shape[1])
        tried = _places_of(slots, range(len(accepted), len(hypotheses)), j, layout.first_extra)
        size = (FOLDS, len(Region))
        product, count = joint_products(columns, fold[use], region[use, j], size, tried)
        kept.append(columns)
        layouts.append(layout)
        products.append(product)
        counts.append(count)
    grams = NormalEquations(
        base.shape[2], tuple(layouts), tuple(products), np.array(counts), rows.least
    )
    t = np.concatenate(
        [
            rows.windows.centres(s.t)[: len(y)]
            for s, y in zip(rows.segments, rows.torque, strict=True)
        ]
    )
    return Table(grams, slots, tuple(hypotheses), tuple(kept), fold, region, segment, t)


def _slots(hypotheses: Sequence[Candidate], dof: int) -> tuple[dict[int, ColumnIndex], list[int]]:
    widths = [0] * dof
    slots = {}
    for i, h in enumerate(hypotheses):
        k = len(h.coefficients)
        slots[i] = ColumnIndex(h.rows, tuple(widths[j] for j in h.rows), k)
        for j in h.rows:
            widths[j] += k
    return slots, widths


def _places_of(
    slots: dict[int, ColumnIndex], which: Iterable[int], joint: int, first: int
) -> list[tuple[int, int]]:
    """First column and number of columns of some hypotheses on a joint."""
    chosen = [slots[i] for i in which if joint in slots[i].joints]
    return [(first + s.starts[s.joints.index(joint)], s.width) for s in chosen]


def _extra_columns(
    rows: WindowedRows,
    model: CurrentModel,
    hypotheses: Sequence[Candidate],
    slots: dict[int, ColumnIndex],
    widths: list[int],
    segment: int,
) -> list[Array]:
    """Windowed columns of all hypotheses in one segment, per joint, shape (R, extra)."""
    s, windows = rows.segments[segment], rows.windows
    count = len(rows.torque[segment])
    found: list[Array] = [np.zeros((count, w)) for w in widths]
    if not hypotheses:
        return found
    views = _Views(s, model, windows)
    for i, h in enumerate(hypotheses):
        key = _key(h, model, segment)
        if key not in rows.formed:
            rows.formed[key] = views.mean(h)[:count]
        for row, (j, start) in enumerate(zip(slots[i].joints, slots[i].starts, strict=True)):
            found[j][:, start : start + slots[i].width] = rows.formed[key][:, row]
    return found


def _key(h: Candidate, model: CurrentModel, segment: int) -> tuple[object, ...]:
    """What the windowed columns of a hypothesis depend on."""
    uses = catalogue()[h.effect].depends_on
    direction = model.shapes[list(h.joints)].tobytes() if "direction" in uses else b""
    parameters = model.facts.delta.tobytes() if "model" in uses else b""
    if "friction" in uses or ("torque" in uses and not model.facts.commanded):
        whole = (model.facts.delta, model.viscous, model.coulomb, model.shapes)
        parameters = b"".join(x.tobytes() for x in (*whole, *(v for _, v in model.carried)))
    return (segment, *h.key, direction, parameters)


class _Views:
    """What effects may look at in one segment, formed when the first of them asks."""

    def __init__(self, s: SmoothedSegment, model: CurrentModel, windows: Windows) -> None:
        self._stretch, self._model, self._windows = s, model, windows
        self._every = body_step(windows)
        self._seen: tuple[Observed, Observed] | None = None

    def mean(self, h: Candidate) -> Array:
        """Windowed columns of a hypothesis, shape (R, len(rows), k)."""
        effect = catalogue()[h.effect]
        if self._seen is None:
            self._seen = observed(self._stretch, self._model, self._every)
        fine, coarse = self._seen
        if effect.band_limited:
            return self._windows.coarser(self._every).mean(effect.columns(coarse, h))
        return self._windows.mean(effect.columns(fine, h))
