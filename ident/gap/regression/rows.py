"""Rows of the regression that do not depend on the model: windowed torque and nominal columns."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.compiled_regressor import regressor
from ident.effects.observation import ArmFacts, Observed
from ident.effects.observing import CurrentModel, observed
from ident.effects.reversal_friction import BASIS
from ident.effects.smoothed_segment import SmoothedSegment
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
        self, s: SmoothedSegment, number: int, model: CurrentModel, every: int
    ) -> tuple[Observed, Observed]:
        """The observations of a segment, by its number; kept for the latest model."""
        if self._seen[0] is not model:
            self._seen = model, {}
        if number not in self._seen[1]:
            self._seen[1][number] = observed(s, model, every)
        return self._seen[1][number]


@dataclass(frozen=True)
class WindowedRows:
    """Windowed rows of all segments.

    Attributes:
        segments: the samples.
        windows: the averaging windows.
        base_parameters: the inertial parameters that the base columns stand for, shape (b,).
        base: windowed base columns, per segment, shape (R, n, b).
        reversals: windowed reversal curves, per segment, shape (R, n, T).
        viscous, torque: per segment, shape (R, n).
        reference_error: that of a reference model's torque [N m], shape (n,), or None.
        parameter_errors: windowed torque [N m] of independent errors of its parameters, each of
            size one, per segment, shape (R, n, k); k is 0 without such a model.
        excluded: rows that no fit may use, shape (R,), or None.
        first_pass: the row at which the arm was there in the same motion for the first time, of
            each row, shape (R,); None: no motion is known to repeat.
        cache: windowed columns of effects.
    """

    segments: tuple[SmoothedSegment, ...]
    windows: Windows
    base_parameters: NDArray[np.int64]
    base: tuple[Array, ...]
    reversals: tuple[Array, ...]
    viscous: tuple[Array, ...]
    torque: tuple[Array, ...]
    parameter_errors: tuple[Array, ...]
    reference_error: Array | None = None
    excluded: NDArray[np.bool_] | None = None
    first_pass: NDArray[np.int64] | None = None
    cache: ColumnCache = field(default_factory=ColumnCache, repr=False, compare=False)

    @property
    def measured_torque(self) -> Array:
        """Windowed torque as it was measured, without a reference subtracted, shape (R, n)."""
        return np.concatenate([self.windows.mean(s.tau) for s in self.segments])

    @property
    def log(self) -> NDArray[np.int64]:
        """Number of the recording of each segment, shape (segments,)."""
        return np.array([s.log for s in self.segments])

    @property
    def segment(self) -> NDArray[np.int64]:
        """Number of the segment of each row, shape (R,)."""
        return np.repeat(np.arange(len(self.torque)), [len(x) for x in self.torque])

    @property
    def t(self) -> Array:
        """Time of each row since its recording's start [s], shape (R,)."""
        parts = zip(self.segments, self.torque, strict=True)
        return np.concatenate([self.windows.centres(s.t)[: len(x)] for s, x in parts])

    @property
    def hop_s(self) -> float:
        """Time from row to row [s]."""
        return self.windows.hop / self.windows.rate_hz


def windowed_rows(
    segments: Sequence[SmoothedSegment],
    windows: Windows,
    facts: ArmFacts,
    base_parameters: NDArray[np.int64],
    reference: ReferenceTorque | None = None,
) -> WindowedRows:
    """Rows of the rigid-body model with friction.

    Args:
        segments: the samples.
        windows: the averaging windows.
        facts: of the arm.
        base_parameters: the inertial parameters to be fitted.
        reference: of a reference model: its torque is subtracted from the measured one.
    """
    every = body_step(windows)
    coarse, middle = windows.coarser(every), slice(every // 2, None, every)
    still = np.where(facts.moving, 1.0, 0.0)
    base, errors = [], []
    for s in segments:
        motion = (s.q[middle], s.qd[middle] * still, s.qdd[middle] * still)
        columns = regressor(facts.chain, *(np.ascontiguousarray(m) for m in motion))
        base.append(coarse.mean(columns[:, :, base_parameters]))
        wrong = np.zeros((*motion[0].shape, 0)) if reference is None else reference.errors(*motion)
        errors.append(coarse.mean(wrong))
    return WindowedRows(
        tuple(segments),
        windows,
        base_parameters,
        tuple(base),
        tuple(_reversal_columns(s, windows) for s in segments),
        tuple(windows.mean(s.qd) for s in segments),
        tuple(
            windows.mean(s.tau if reference is None else s.tau - reference.torque(s))
            for s in segments
        ),
        tuple(errors),
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
