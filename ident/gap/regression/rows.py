"""Rows of the regression that do not depend on the model: windowed torque and nominal columns."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.compiled_regressor import regressor
from ident.effects.observation import ArmFacts, Observed
from ident.effects.observing import CurrentModel, observed
from ident.effects.reversal_friction import BASIS
from ident.effects.smoothed_segment import SmoothedSegment
from ident.gap.data.blocks import Blocks
from ident.gap.data.reference_model import ReferenceTorque
from ident.gap.data.windows import Windows, body_step
from ident.signals.arrays import Array


class ColumnCache:
    """Windowed columns of effects, and what they are formed from, formed once.

    It only saves time: a column is a pure function of its key, an observation of its model.

    Attributes:
        columns: by key.
    """

    def __init__(self) -> None:
        self.columns: dict[tuple[object, ...], Array] = {}
        self._seen: tuple[CurrentModel | None, dict[int, tuple[Observed, Observed]]] = None, {}

    def get(self, key: tuple[object, ...], form: Callable[[], Array]) -> Array:
        """The columns of a key, formed if they are not known yet."""
        if key not in self.columns:
            self.columns[key] = form()
        return self.columns[key]

    def observed(
        self, s: SmoothedSegment, model: CurrentModel, every: int
    ) -> tuple[Observed, Observed]:
        """The observations of a segment; kept for the latest model."""
        if self._seen[0] is not model:
            self._seen = model, {}
        if id(s) not in self._seen[1]:
            self._seen[1][id(s)] = observed(s, model, every)
        return self._seen[1][id(s)]


@dataclass(frozen=True)
class WindowedRows:
    """Windowed rows of all recordings.

    Attributes:
        blocks: the samples, and which of their windows are rows.
        base_parameters: the inertial parameters that the base columns stand for, shape (b,).
        base: windowed base columns, shape (R, n, b).
        reversals: windowed reversal curves, shape (R, n, T).
        viscous, torque: shape (R, n).
        parameter_errors: windowed torque [N m] of independent errors of a reference model's
            parameters, each of size one, shape (R, n, k); k is 0 without such a model.
        reference_error: that of the reference model's torque [N m], shape (n,), or None.
        excluded: rows that no fit may use, shape (R,), or None.
        first_pass: the row at which the arm was there in the same motion for the first time, of
            each row, shape (R,); None: no motion is known to repeat.
        cache: windowed columns of effects.
    """

    blocks: Blocks
    base_parameters: NDArray[np.int64]
    base: Array
    reversals: Array
    viscous: Array
    torque: Array
    parameter_errors: Array
    reference_error: Array | None = None
    excluded: NDArray[np.bool_] | None = None
    first_pass: NDArray[np.int64] | None = None
    cache: ColumnCache = field(default_factory=ColumnCache, repr=False, compare=False)

    @property
    def segments(self) -> tuple[SmoothedSegment, ...]:
        """The samples, without a hole in each."""
        return self.blocks.segments

    @property
    def windows(self) -> Windows:
        """The averaging windows."""
        return self.blocks.windows

    @property
    def measured_torque(self) -> Array:
        """Windowed torque as it was measured, without a reference subtracted, shape (R, n)."""
        return self.blocks.means(lambda s: s.tau)

    @property
    def log(self) -> NDArray[np.int64]:
        """Number of the recording of each row, shape (R,)."""
        return self.blocks.log

    @property
    def t(self) -> Array:
        """Time of each row since its recording's start [s], shape (R,)."""
        return self.blocks.rows(lambda s: self.windows.centres(s.t))

    @property
    def hop_s(self) -> float:
        """Time from row to row [s]."""
        return self.windows.hop / self.windows.rate_hz


def windowed_rows(
    blocks: Blocks,
    facts: ArmFacts,
    base_parameters: NDArray[np.int64],
    reference: ReferenceTorque | None = None,
) -> WindowedRows:
    """Rows of the rigid-body model with friction.

    Args:
        blocks: the samples, and which of their windows are rows.
        facts: of the arm.
        base_parameters: the inertial parameters to be fitted.
        reference: of a reference model: its torque is subtracted from the measured one.
    """
    every = body_step(blocks.windows)
    coarse, middle = blocks.windows.coarser(every), slice(every // 2, None, every)
    still = np.where(facts.moving, 1.0, 0.0)

    def motion(s: SmoothedSegment) -> tuple[Array, ...]:
        parts = (s.q[middle], s.qd[middle] * still, s.qdd[middle] * still)
        return tuple(np.ascontiguousarray(m) for m in parts)

    def base(s: SmoothedSegment) -> Array:
        return coarse.mean(regressor(facts.chain, *motion(s))[:, :, base_parameters])

    def errors(s: SmoothedSegment) -> Array:
        if reference is None:
            return np.zeros((len(blocks.windows.centres(s.t)), facts.dof, 0))
        return coarse.mean(reference.errors(*motion(s)))

    return WindowedRows(
        blocks,
        base_parameters,
        blocks.rows(base),
        blocks.rows(lambda s: _reversal_columns(s, blocks.windows)),
        blocks.means(lambda s: s.qd),
        blocks.means(lambda s: s.tau if reference is None else s.tau - reference.torque(s)),
        blocks.rows(errors),
        None if reference is None else reference.noise,
    )


def _reversal_columns(s: SmoothedSegment, windows: Windows) -> Array:
    joints = range(s.q.shape[1])
    return np.stack(
        [
            windows.mean(np.stack([c(s.q[:, j], s.speeds[..., j]) for j in joints], axis=-1))
            for c in BASIS
        ],
        axis=-1,
    )
