"""From samples to regression rows: smooth, form the regressor, filter it like the torque."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from itertools import groupby
from operator import itemgetter
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.base_parameters import BaseMap
from ident.dynamics.parameters import Parameter, Terms
from ident.dynamics.regressor import SHARP, Motion, sharp_columns, smooth_columns
from ident.recordings.dataset import Dataset, Segment, Span
from ident.recordings.errors import TooShortError
from ident.regression.filters import Processing
from ident.regression.reversal_columns import curve_columns, regions_of
from ident.signals.arrays import Array
from ident.signals.zero_phase import Lowpass, Spectrum, delayed, extended, fast_length, spectrum
from wamctl.arm.robot import Robot

_WINDOW_SAMPLES = 16_000


@dataclass(frozen=True)
class Rows:
    """Regression rows of consecutive instants, R of them, for the m moving joints.

    Attributes:
        t: time since the recording's first sample [s], shape (R,).
        speed: velocity of each moving joint, by which rows are culled [rad/s], shape (R, m).
        W: regressor of the b base parameters, filtered, shape (R, m, b).
        tau: torque, filtered alike [N m], shape (R, m).
        tau_rate: its derivative [N m/s], shape (R, m).
        W_raw: regressor along the motion smoothed at the same cut-off (the paper's way), not
            filtered itself, shape (R, m, b).
        tau_raw: torque as recorded [N m], shape (R, m).
        curves, curves_raw: Coulomb friction's column along each curve that it may follow at
            reversals, of the joint's own row, filtered like W and not filtered, shape (R, m, T);
            T is zero where it changes sign at once.
        region: of each row, by the distance from a reversal, shape (R, m).
        regressor_s: time that forming the regressor took [s].
    """

    t: Array
    speed: Array
    W: Array
    tau: Array
    tau_rate: Array
    W_raw: Array
    tau_raw: Array
    curves: Array
    curves_raw: Array
    region: NDArray[np.int64]
    regressor_s: float = 0.0


@dataclass(frozen=True)
class Window:
    """A stretch of samples with what lies beside it, or its reflection at the recording's ends.

    Attributes:
        t: time of the first sample that counts [s].
        q, tau: shape (L, n), with `before` samples ahead of those that count.
        before: number of samples ahead, a multiple of the row step.
        count: number of samples that count.
    """

    t: float
    q: Array
    tau: Array
    before: int
    count: int


class FurtherColumns(Protocol):
    """Torque per unit of what the base parameters do not hold, as smooth as the motion."""

    @property
    def count(self) -> int:
        """Number of columns."""
        ...

    def __call__(self, motion: Motion) -> Array:
        """Columns along S samples of n joints, shape (S, n, count)."""
        ...


@dataclass(frozen=True)
class Regressor:
    """What forms the rows of one arm.

    Attributes:
        robot: kinematics, frames, and gravity.
        terms: friction and rotors.
        base: the base parameters that are wanted.
        moving: which joints move, shape (n,).
        further: columns that follow those of the base parameters in W; None: there are none.
    """

    robot: Robot
    terms: Terms
    base: BaseMap
    moving: NDArray[np.bool_]
    further: FurtherColumns | None = None

    @property
    def columns(self) -> list[Parameter]:
        """The parameters in the order in which their columns are formed: links, drives, jumps."""
        return sorted(self.base.kept_parameters, key=_column_group)

    @property
    def order(self) -> NDArray[np.intp]:
        """Places that bring the columns as formed into the order of beta, further ones last."""
        groups = [_column_group(p) for p in self.base.kept_parameters]
        further = [1] * (self.further.count if self.further else 0)
        return np.argsort(np.argsort(groups + further, kind="stable"))


def _column_group(parameter: Parameter) -> int:
    return 2 if parameter.kind in SHARP else int(parameter.kind != "inertial")


def rows_of(data: Dataset, process: Processing, regressor: Regressor) -> Iterator[Rows]:
    """All rows of a recording, window by window, so that memory does not grow with its length.

    Raises:
        TooShortError: no stretch of the recording is long enough for the filter.
    """
    least = process.least_s
    longest = max(span.length for span in data.spans) / data.rate_hz
    if longest <= least:
        raise TooShortError(data.name, longest, least, process.cutoff_hz)
    for number, parts in groupby(data.read(), key=itemgetter(0)):
        span = data.spans[number]
        if span.length / data.rate_hz > least:
            for window in windows(span, (part for _, part in parts), data.rate_hz, process):
                yield rows_of_window(window, data.rate_hz, process, regressor)


def windows(
    span: Span, parts: Iterator[Segment], rate_hz: float, process: Processing
) -> Iterator[Window]:
    """The span in windows; its ends, where the filter has no past or future, are left out.

    Args:
        span: what is wanted.
        parts: its samples, in order of time.
        rate_hz: of the samples.
        process: the filters.
    """
    step = process.row_every
    margin = step * int(np.ceil(process.margin_s * rate_hz / step))
    trim = int(np.ceil(process.trim_s * rate_hz))
    end = min(span.used[1], span.length - trim)
    samples = _Samples(span, parts)
    for start in range(max(span.used[0], trim), end, step * (_WINDOW_SAMPLES // step)):
        count = min(step * (_WINDOW_SAMPLES // step), end - start)
        length = fast_length(count + 2 * margin, step)
        q, tau = samples.between(start - margin, start - margin + length)
        yield Window(span.start_s + start / rate_hz, q, tau, margin, count)


class _Samples:
    """What is still needed of a span while a window moves along it."""

    def __init__(self, span: Span, parts: Iterator[Segment]) -> None:
        self._length, self._parts = span.length, parts
        self._first = 0
        self._held: list[Segment] = []

    def between(self, start: int, stop: int) -> tuple[Array, Array]:
        """Position and torque of samples, continued by reflection beyond the span's ends.

        Args:
            start: the first; never before that of an earlier call.
            stop: their end.
        """
        while self._held and self._first + len(self._held[0].q) <= start:
            self._first += len(self._held.pop(0).q)
        have = self._first + sum(len(part.q) for part in self._held)
        while have < min(stop, self._length):
            self._held.append(next(self._parts))
            have += len(self._held[-1].q)
            if have <= start:
                self._first += len(self._held.pop().q)
        inside = slice(max(start, 0) - self._first, min(stop, self._length) - self._first)
        before, after = max(-start, 0), max(stop - self._length, 0)
        q, tau = (
            _reflected(np.concatenate(columns)[inside], before, after)
            for columns in zip(*((part.q, part.tau) for part in self._held), strict=True)
        )
        return q, tau


def _reflected(samples: Array, before: int, after: int) -> Array:
    """The samples continued at both ends by their reflection."""
    head = _continued(samples[: before + 1], before, 0)[:before]
    tail = _continued(samples[-after - 1 :], 0, after)[-after:] if after else samples[:0]
    return np.concatenate([head, samples, tail])


def _continued(samples: Array, before: int, after: int) -> Array:
    """The samples with their reflections, which are reflected again where they are too short."""
    while before or after:
        reach = len(samples) - 1
        samples = extended(samples, min(before, reach), min(after, reach))
        before, after = max(before - reach, 0), max(after - reach, 0)
    return samples


def rows_of_window(
    window: Window, rate_hz: float, process: Processing, regressor: Regressor
) -> Rows:
    """The rows of one window."""
    every, lowpass = process.row_every, process.columns or process.motion
    positions = spectrum(window.q, rate_hz)
    sign_speed = positions.signal(process.sign, 1)
    tau = window.tau[:, regressor.moving]
    if process.delay_s:
        tau = delayed(tau, rate_hz, process.delay_s)
    torque = spectrum(tau, rate_hz)
    begin = time.perf_counter()
    coarse = _columns(_motion(positions, lowpass, every), sign_speed[::every], regressor)
    formed = coarse
    if process.columns is not None:
        fine = _motion(positions, process.motion, process.body_every)
        formed = _columns(fine, sign_speed, regressor)
    regressor_s = time.perf_counter() - begin
    columns, tau_rows = coarse, tau[::every]
    if process.columns is not None:
        smooth, sharp = formed
        body_rate, step = rate_hz / process.body_every, every // process.body_every
        columns = (
            _filtered(smooth, body_rate, lowpass, step),
            _filtered(sharp, rate_hz, lowpass, every),
        )
        tau_rows = torque.signal(lowpass, every=every)
    curves = curve_columns(positions, process, regressor.moving)
    region = regions_of(sign_speed[:, regressor.moving], rate_hz, process)
    rows = Rows(
        t=window.t + (np.arange(len(tau_rows)) - window.before // every) * every / rate_hz,
        speed=sign_speed[::every][:, regressor.moving],
        W=np.concatenate(columns, axis=2)[..., regressor.order],
        tau=tau_rows,
        tau_rate=torque.signal(lowpass, 1, every),
        W_raw=np.concatenate(coarse, axis=2)[..., regressor.order],
        tau_raw=tau[::every],
        curves=_filtered_by_joint(curves, rate_hz, lowpass, every),
        curves_raw=curves[::every],
        region=region[::every],
        regressor_s=regressor_s,
    )
    first = window.before // every
    return _part(rows, slice(first, first + -(-window.count // every)))


def _part(rows: Rows, part: slice) -> Rows:
    arrays = {f.name: getattr(rows, f.name)[part] for f in fields(rows) if f.name != "regressor_s"}
    return replace(rows, **arrays)


def _motion(positions: Spectrum, lowpass: Lowpass, every: int) -> Motion:
    """The smoothed motion of every so-manieth sample."""
    return Motion(*(positions.signal(lowpass, derivative, every) for derivative in range(3)))


def _columns(body: Motion, sharp_speed: Array, regressor: Regressor) -> tuple[Array, Array]:
    """Smooth and sharp columns of the moving joints' rows."""
    robot, terms, moving = regressor.robot, regressor.terms, regressor.moving
    columns = regressor.columns
    smooth = smooth_columns(robot, terms, body, [p for p in columns if p.kind not in SHARP])
    sharp = sharp_columns(terms, sharp_speed * moving, [p for p in columns if p.kind in SHARP])
    if regressor.further is not None:
        smooth = np.concatenate([smooth, regressor.further(body)], axis=2)
    return smooth[:, moving], sharp[:, moving]


def _filtered(columns: Array, rate_hz: float, lowpass: Lowpass, every: int) -> Array:
    """Columns through the torque's filter; those that are zero throughout are passed over."""
    used = np.any(columns != 0, axis=0)
    result = np.zeros((len(columns) // every, *columns.shape[1:]))
    result[:, used] = spectrum(columns[:, used], rate_hz).signal(lowpass, every=every)
    return result


def _filtered_by_joint(columns: Array, rate_hz: float, lowpass: Lowpass, every: int) -> Array:
    """The same, joint by joint: all curves together would leave the processor's cache."""
    parts = [_filtered(columns[:, j], rate_hz, lowpass, every) for j in range(columns.shape[1])]
    return np.stack(parts, axis=1)
