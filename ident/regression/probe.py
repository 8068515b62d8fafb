"""A thin sample of some recordings, on which a hypothesis about the data is tried in milliseconds.

Positions and torque pass the same low-pass filter, and a few hundred instants are kept. A
hypothesis (two columns swapped, a joint's zero a right angle off) changes the samples; the least
squares of the rigid body with friction and offset then tell whether the torque fits better.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from ident.dynamics.regressor import Motion
from ident.recordings.dataset import Dataset
from ident.recordings.samples import resampled
from ident.signals.arrays import Array
from ident.signals.zero_phase import Lowpass, Spectrum, extended, fast_length, spectrum

LEAST_SAMPLES = 16
"""In a row; fewer are no chunk."""

_CHUNK = 1 << 16
"""Samples that are filtered together."""

_MOST_SAMPLES = 4 * _CHUNK
"""Of all recordings together, about."""

_OVERSAMPLING = 20
"""Samples per period of the cut-off that are kept for the sign of the velocity."""

_HIGHEST_SHARE = 0.4
"""Of the sampling rate: the highest cut-off."""

_STILL = 0.02
"""Part of its fastest speed that a held joint does not reach in `_ABOUT_S` before and after."""

_ABOUT_S = 0.5
_LEAST_TIME = 1 / 12
"""Part of a recording in which a joint has to move: less tells nothing beside the links' many
parameters."""

_TRIM = 4.0
"""Time constants at both ends of a chunk that are left out."""


@dataclass(frozen=True)
class Chunk:
    """Consecutive samples of one recording.

    Attributes:
        log: number of the recording, from 0.
        rate_hz: of the samples.
        start_s: time of the first one since the recording's first [s].
        q: position [rad], shape (S, n).
        tau: torque [N m], shape (S, n).
    """

    log: int
    rate_hz: float
    start_s: float
    q: Array
    tau: Array

    def with_torque_later(self, seconds: float) -> "Chunk":
        """The same with torque that acts so much later than its stamps, to the nearest sample."""
        places = np.arange(len(self.tau)) - round(seconds * self.rate_hz)
        return replace(self, tau=self.tau[np.clip(places, 0, len(self.tau) - 1)])


@dataclass(frozen=True)
class Probe:
    """Instants of some recordings, S of them, joints in the robot's order.

    Attributes:
        log: number of each instant's recording, shape (S,).
        t: time since the recording's first sample [s], shape (S,).
        motion: smoothed position, velocity, and acceleration, shape (S, n) each.
        sign: the velocity's sign, filtered like the torque, shape (S, n).
        tau: torque, filtered [N m], shape (S, n).
        raw: torque as recorded [N m], shape (S, n).
        counted: whose torque counts: joints that move about that instant, shape (S, n). One that
            is held may hold by friction, whose torque no motion tells.
        cutoff_hz: of the filter.
    """

    log: NDArray[np.intp]
    t: Array
    motion: Motion
    sign: Array
    tau: Array
    raw: Array
    counted: NDArray[np.bool_]
    cutoff_hz: float

    @property
    def moving(self) -> NDArray[np.bool_]:
        """Which joints move in any recording, shape (n,)."""
        return np.logical_or.reduce(self.counted, axis=0)

    def every(self, count: int) -> "Probe":
        """One of so many instants."""
        rows = slice(None, None, count)
        motion = Motion(*(x[rows] for x in (self.motion.q, self.motion.qd, self.motion.qdd)))
        found = replace(self, log=self.log[rows], t=self.t[rows], motion=motion)
        found = replace(found, sign=self.sign[rows], tau=self.tau[rows], raw=self.raw[rows])
        return replace(found, counted=self.counted[rows])

    def scaled(self, factor: float) -> "Probe":
        """The same motion with all positions multiplied."""
        q, qd, qdd = (factor * x for x in (self.motion.q, self.motion.qd, self.motion.qdd))
        return replace(self, motion=Motion(q, qd, qdd))

    def shifted(self, offset: Array) -> "Probe":
        """The same motion about other zero poses [rad], shape (n,)."""
        return replace(self, motion=replace(self.motion, q=self.motion.q + offset))

    def turned(self, signs: Array) -> "Probe":
        """The same recording with some joints counted the other way round, shape (n,) of +-1."""
        m = self.motion
        motion = Motion(m.q * signs, m.qd * signs, m.qdd * signs)
        return replace(self, motion=motion, sign=self.sign * signs)

    def positions_of(self, columns: Sequence[int]) -> "Probe":
        """The same torque with the positions of other columns."""
        c, m = list(columns), self.motion
        motion = Motion(m.q[:, c], m.qd[:, c], m.qdd[:, c])
        return replace(self, motion=motion, sign=self.sign[:, c])


def chunks_of(data: Sequence[Dataset]) -> list[Chunk]:
    """Evenly spread chunks of all recordings; whole recordings where they are short."""
    found = []
    for log, one in enumerate(data):
        chunks = [c for c in _chunks(log, one) if len(c.q) >= LEAST_SAMPLES]
        found += _spread(chunks, _MOST_SAMPLES // len(data))
    return found


def _spread(chunks: Sequence[Chunk], most: int) -> Sequence[Chunk]:
    """All chunks, or evenly spread ones that hold so many samples, or the longest one's."""
    lengths = np.array([len(c.q) for c in chunks])
    if lengths.sum() <= most:
        return chunks
    ends = np.cumsum(lengths)
    marks = max(most, lengths.max()) / (lengths.max() * ends[-1])  # for each sample
    passed = np.floor(ends * marks + 0.5) > np.floor((ends - lengths) * marks + 0.5)
    return [chunk for chunk, kept in zip(chunks, passed, strict=True) if kept]


def _chunks(log: int, data: Dataset) -> list[Chunk]:
    found: list[Chunk] = []
    last = -1
    for number, part in data.read():
        for first in range(0, len(part.q), _CHUNK):
            piece = slice(first, first + _CHUNK)
            q, tau = part.q[piece], part.tau[piece]
            whole = found[-1] if found and number == last else None
            if whole is not None and len(whole.q) + len(q) <= _CHUNK:
                together = np.concatenate([whole.q, q]), np.concatenate([whole.tau, tau])
                found[-1] = replace(whole, q=together[0], tau=together[1])
            else:
                start = part.start_s + first / data.rate_hz
                found.append(Chunk(log, data.rate_hz, start, q, tau))
            last = number
    return found


def probe_of(
    chunks: Sequence[Chunk], moving: NDArray[np.bool_], cutoff_hz: float, instants: int
) -> Probe:
    """The probe of some chunks.

    Args:
        chunks: of all recordings.
        moving: which joints move in each recording, shape (L, n).
        cutoff_hz: of the low-pass filter.
        instants: number of instants that is wanted, about.
    """
    seconds = sum(len(c.q) / c.rate_hz for c in chunks)
    parts = [_filtered(c, cutoff_hz, seconds / instants) for c in chunks]
    log, t, q, qd, qdd, sign, tau, raw, moves = map(np.concatenate, zip(*parts, strict=True))
    counted = moving[log] & moves
    for k in np.unique(log):
        counted[log == k] &= moves[log == k].mean(axis=0) > _LEAST_TIME
    motion = Motion(q, qd * counted, qdd * counted)
    return Probe(log, t, motion, sign * counted, tau, raw, counted, cutoff_hz)


@dataclass(frozen=True)
class _Grid:
    """Where a chunk is filtered: continued at both ends, and thinned.

    Attributes:
        lowpass: the filter.
        every: one sample of so many is kept.
        before, after: samples by which the chunk is continued.
        length: of the transform.
    """

    lowpass: Lowpass
    every: int
    before: int
    after: int
    length: int

    def spectra(self, signals: Array) -> Spectrum:
        """The spectra of the continued signals."""
        padded = extended(signals, self.before, self.after)
        fill = np.repeat(padded[-1:], self.length - len(padded), axis=0)
        return spectrum(np.concatenate([padded, fill]), self.lowpass.rate_hz)


def _grid(chunk: Chunk, cutoff_hz: float) -> _Grid:
    rate, count = chunk.rate_hz, len(chunk.q)
    lowpass = Lowpass(min(cutoff_hz, _HIGHEST_SHARE * rate), 3, rate)
    every = max(1, int(rate / (_OVERSAMPLING * lowpass.cutoff_hz)))
    margin = min(count - 1, int(np.ceil(lowpass.memory_s * rate / 2)))
    before = margin - margin % every
    length = fast_length(count + before, every)
    return _Grid(lowpass, every, before, min(length - count - before, count - 1), length)


def filtered_torque(chunk: Chunk, cutoff_hz: float) -> tuple[Array, Array]:
    """Instants since the recording's first [s], shape (G,), and the torque there, shape (G, n)."""
    grid, rate = _grid(chunk, cutoff_hz), chunk.rate_hz
    tau = grid.spectra(chunk.tau).signal(grid.lowpass, every=grid.every)
    first, count = grid.before // grid.every, -(-len(chunk.q) // grid.every)
    t = chunk.start_s + np.arange(count) * grid.every / rate
    return t, tau[first : first + count]


def _filtered(chunk: Chunk, cutoff_hz: float, step_s: float) -> tuple[Array, ...]:
    """Recording, time, position and its derivatives, sign, torque, and whether each joint moves."""
    rate, count = chunk.rate_hz, len(chunk.q)
    grid = _grid(chunk, cutoff_hz)
    lowpass, every, before = grid.lowpass, grid.every, grid.before
    coarse = replace(lowpass, rate_hz=rate / every)
    positions = grid.spectra(chunk.q)
    q, qd, qdd = (positions.signal(lowpass, k, every) for k in range(3))
    sign = spectrum(np.sign(qd), rate / every).signal(coarse)
    tau = grid.spectra(chunk.tau).signal(lowpass, every=every)
    raw = np.zeros_like(tau)
    places = np.arange(before // every, before // every + -(-count // every))
    raw[places] = chunk.tau[::every]
    trim = min(int(_TRIM * lowpass.time_constant_s * rate), count // 4)
    first, end = -(-(before + trim) // every), (before + count - trim) // every
    kept = slice(first, max(end, first + 1), max(1, round(step_s * rate / every)))
    t = chunk.start_s + (np.arange(len(q)) * every - before) / rate
    speed, about = np.abs(qd), 2 * round(_ABOUT_S * rate / every) + 1
    fastest = speed[first : max(end, first + 1)].max(axis=0)  # beyond lies what the filter needs
    moves = maximum_filter1d(speed, about, axis=0) > _STILL * fastest
    t, *rest = (x[kept] for x in (t, q, qd, qdd, sign, tau, raw, moves))
    return np.full(len(t), chunk.log), t, *rest


def shifted_torque(
    chunks: Sequence[Chunk], probe: Probe, delays_s: Sequence[float]
) -> tuple[Array, NDArray[np.bool_]]:
    """Torque that was recorded so much later than each of the probe's instants.

    Args:
        chunks: of which the probe was made.
        probe: its instants, S of them.
        delays_s: the shifts, D of them [s].

    Returns:
        The torque [N m], shape (D, S, n), and the instants of which all of it was recorded, (S,).
    """
    found = np.zeros((len(delays_s), *probe.tau.shape))
    known = np.zeros(len(probe.t), dtype=bool)
    reach = max(max(delays_s), 0.0), max(-min(delays_s), 0.0)
    for chunk in chunks:
        t, tau = filtered_torque(chunk, probe.cutoff_hz)
        own = (probe.log == chunk.log) & (probe.t + reach[0] <= t[-1])
        own &= probe.t - reach[1] >= t[0]
        known |= own
        for k, delay in enumerate(delays_s):
            found[k, own] = resampled(t, tau, probe.t[own] + delay)
    return found, known
