"""The design matrix: columns of the nominal model, of accepted effects and of candidates."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.effects.observing import CurrentModel
from ident.effects.smoothed_segment import SmoothedSegment
from ident.gap.data.blocks import EXCLUDED, FOLDS
from ident.gap.data.noise_regions import Region, regions
from ident.gap.data.windows import body_step
from ident.gap.regression.model_columns import ColumnIndex, ModelStructure
from ident.gap.regression.normal_equations import Layout, NormalEquations, joint_products
from ident.gap.regression.rows import WindowedRows
from ident.signals.arrays import Array

_ABSENT = 1e-12  # a base column this small is rounding: the joint does not feel the parameter


@dataclass(frozen=True)
class DesignMatrix:
    """Rows and columns, with the inner products made of them.

    Attributes:
        equations: inner products by fold and region.
        index: columns of each effect.
        effects: accepted effects first, then candidates.
        accepted: number of accepted effects.
        columns: per joint, shape (R, p), in the order of its layout; no rows for held joints.
        fold: of each row, shape (R,).
        region: noise region of each row and joint, shape (R, n).
        block: number of the block of time of each row, shape (R,).
        t: time of each row since its recording's start [s], shape (R,).
    """

    equations: NormalEquations
    index: tuple[ColumnIndex, ...]
    effects: tuple[Candidate, ...]
    accepted: int
    columns: tuple[Array, ...]
    fold: NDArray[np.int64]
    region: NDArray[np.int64]
    block: NDArray[np.int64]
    t: Array

    def of(self, folds: Sequence[int]) -> "DesignMatrix":
        """The same with the inner products of some folds, as one fold."""
        return replace(self, equations=self.equations.of(folds))

    def structure(self, shapes: Array) -> ModelStructure:
        """The model with all accepted effects."""
        return ModelStructure(shapes, self.index[: self.accepted])

    def with_folds(self, fold: NDArray[np.int64], count: int = FOLDS) -> "DesignMatrix":
        """The same rows divided into some number of other folds, shape (R,)."""
        products = [self._products(j, layout, fold, count) for j, layout in enumerate(self.layouts)]
        equations = replace(
            self.equations,
            products=tuple(p for p, _ in products),
            counts=np.array([count for _, count in products]),
        )
        return replace(self, fold=fold, equations=equations)

    @property
    def folds(self) -> int:
        """Number of folds."""
        return self.equations.counts.shape[1]

    @property
    def layouts(self) -> tuple[Layout, ...]:
        """Order of the columns, per joint."""
        return self.equations.layouts

    def places(self, index: int, joint: int) -> slice:
        """Columns of an effect on one of its joints."""
        effect = self.index[index]
        start = self.layouts[joint].first_effect + effect.starts[effect.joints.index(joint)]
        return slice(start, start + effect.width)

    def effect_columns(self, index: int, joint: int) -> Array:
        """Columns of an effect on one of its joints, shape (R, k); no rows for a held joint."""
        return self.columns[joint][:, self.places(index, joint)]

    def _products(
        self, joint: int, layout: Layout, fold: NDArray[np.int64], count: int
    ) -> tuple[Array, NDArray[np.int64]]:
        columns = self.columns[joint]
        used = slice(len(columns))
        candidates = [
            (layout.first_effect + e.starts[e.joints.index(joint)], e.width)
            for e in self.index[self.accepted :]
            if joint in e.joints
        ]
        size = (count, len(Region))
        return joint_products(columns, fold[used], self.region[used, joint], size, candidates)


def build_design_matrix(
    rows: WindowedRows,
    model: CurrentModel,
    accepted: Sequence[Candidate],
    candidates: Sequence[Candidate] = (),
) -> DesignMatrix:
    """All columns and their inner products.

    Args:
        rows: torque and nominal columns.
        model: current estimates, with which the effects' columns are formed.
        accepted: effects that are in the model together.
        candidates: effects of which any fit has one at most.
    """
    effects = (*accepted, *candidates)
    index, widths = _index(effects, model.facts.dof)
    formed = [
        rows.cache.get(_key(h, model), lambda h=h: _effect_columns(rows, model, h)) for h in effects
    ]
    base, torque = rows.base, rows.torque
    layouts, columns = [], []
    for j in range(model.facts.dof):
        felt = np.flatnonzero(np.abs(base[:, j]).max(axis=0) > _ABSENT)
        layouts.append(Layout(felt, rows.reversals.shape[2], widths[j]))
        nominal = [base[:, j, felt], rows.viscous[:, j], rows.reversals[:, j]]
        extra = np.zeros((len(torque), widths[j]))
        for where, own in zip(index, formed, strict=True):
            if j in where.joints:
                row = where.joints.index(j)
                start = where.starts[row]
                extra[:, start : start + where.width] = own[:, row]
        whole = np.column_stack([*nominal, extra, torque[:, j]])
        columns.append(whole if model.facts.moving[j] else whole[:0])
    region, fold = _row_labels(rows, model)
    empty = NormalEquations(
        base.shape[2], tuple(layouts), (), np.zeros(0, dtype=int), rows.reference_error
    )
    design = DesignMatrix(
        empty,
        index,
        effects,
        len(accepted),
        tuple(columns),
        fold,
        region,
        rows.blocks.number,
        rows.t,
    )
    return design.with_folds(fold)


def _row_labels(
    rows: WindowedRows, model: CurrentModel
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Region and fold of each row."""
    motors = model.facts.motor_from_joint
    region = rows.blocks.rows(lambda s: regions(s.speeds[1], model.slow, motors, rows.windows))
    if rows.excluded is None:
        return region, rows.blocks.fold
    return region, np.where(rows.excluded, EXCLUDED, rows.blocks.fold)


def _index(effects: Sequence[Candidate], dof: int) -> tuple[tuple[ColumnIndex, ...], list[int]]:
    """Where each effect's columns are, and how many columns each joint has."""
    widths = [0] * dof
    index = []
    for h in effects:
        k = len(h.coefficients)
        index.append(ColumnIndex(h.rows, tuple(widths[j] for j in h.rows), k))
        for j in h.rows:
            widths[j] += k
    return tuple(index), widths


def _effect_columns(rows: WindowedRows, model: CurrentModel, h: Candidate) -> Array:
    """Windowed columns of an effect, shape (R, len(rows), k), decimated where that is enough."""
    effect, every = catalogue()[h.effect], body_step(rows.windows)
    windows = rows.windows.coarser(every) if effect.band_limited else rows.windows

    def of_windows(s: SmoothedSegment) -> Array:
        fine, coarse = rows.cache.observed(s, model, every)
        return windows.mean(effect.columns(coarse if effect.band_limited else fine, h))

    return rows.blocks.rows(of_windows)


def _key(h: Candidate, model: CurrentModel) -> tuple[object, ...]:
    """Everything that the windowed columns of an effect depend on."""
    uses = catalogue()[h.effect].depends_on
    direction = model.shapes[list(h.joints)].tobytes() if "direction" in uses else b""
    parameters = model.facts.delta.tobytes() if "model" in uses else b""
    if "friction" in uses or ("torque" in uses and not model.facts.commanded):
        whole = (model.facts.delta, model.viscous, model.coulomb, model.shapes)
        parameters = b"".join(x.tobytes() for x in (*whole, *(v for _, v in model.carried)))
    return (*h.key, direction, parameters)
