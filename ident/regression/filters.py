"""How a recording is filtered: cut-offs and rates, from the arm's settings and the data."""

from dataclasses import dataclass

import numpy as np

from ident.effects.reversal_friction import BASIS, ENDING, SmoothedSign
from ident.model.arm import Arm
from ident.recordings.dataset import Dataset
from ident.signals.arrays import Array
from ident.signals.zero_phase import Lowpass
from wamctl.arm.errors import DataError

_OVER_HARMONIC = 10
_BODY_OVERSAMPLING = 10
_ROW_OVERSAMPLING = 20
_HIGHEST_SHARE = 0.4
_DIFFERENTIATION = (4.0, 25.0)
_ENERGY = 0.99
_MOST_SAMPLES = 1 << 16
_TRIM = 8
_LEAST_TRIMS = 4
_TO_FIT = 1.001  # times the cut-off of which a stretch is as long as it has to be

CURVES = tuple(
    curve for curve, ends in zip(BASIS, ENDING, strict=True) if ends and curve.cutoff in (None, 1)
)
"""Curves of distance, and those of one of the velocities: after the rows' low-pass, which leaves
out what is as fast as the difference between them, the others explain nothing more."""


@dataclass(frozen=True)
class Processing:
    """The filters of one recording.

    Attributes:
        columns: low-pass of torque and regressor columns alike (parallel filtering); None in the
            paper's way, which filters position only.
        motion: low-pass that smooths and differentiates position.
        sign: low-pass of the velocity whose sign Coulomb friction takes.
        body_every: the links' regressor is formed at every so-manieth sample.
        row_every: one regression row is kept of so many samples; a multiple of `body_every`.
        threshold_rad_s: slower samples are culled [rad/s]; zero while it is to be chosen.
        delay_s: the torque of the log acts so much later than its stamp [s].
        curves: along which dry friction may turn round; none where it does so at once.
        reason: where the cut-off comes from.
    """

    columns: Lowpass | None
    motion: Lowpass
    sign: Lowpass
    body_every: int
    row_every: int
    threshold_rad_s: float
    delay_s: float
    curves: tuple[SmoothedSign, ...]
    reason: str

    @property
    def cutoff_hz(self) -> float:
        """The cut-off that decides what is kept [Hz]."""
        return (self.columns or self.motion).cutoff_hz

    @property
    def margin_s(self) -> float:
        """Length beside a window that its rows depend on [s]."""
        filters = (self.columns, self.motion, self.sign)
        return sum(f.memory_s for f in filters if f is not None)

    @property
    def trim_s(self) -> float:
        """Length at each end of a recording whose rows are left out [s]: eight time constants."""
        return _TRIM * (self.columns or self.motion).time_constant_s

    @property
    def least_s(self) -> float:
        """Length of the shortest stretch that is used [s]: half of it is left."""
        return _LEAST_TRIMS * self.trim_s


def processing(arm: Arm, data: Dataset, curves: tuple[SmoothedSign, ...] = CURVES) -> Processing:
    """The filters for a recording.

    Args:
        arm: its settings.
        data: the recording.
        curves: along which dry friction may turn round, unless the settings say that it does so
            at once.

    Raises:
        DataError: a cut-off that the sampling rate cannot carry.
    """
    settings, rate = arm.settings, data.rate_hz
    cutoff, reason = _cutoff(arm, data)
    highest = _HIGHEST_SHARE * rate
    if cutoff > highest:
        raise DataError(
            f"{data.name} has {rate:.4g} samples a second, too few for a cut-off of {cutoff:g} Hz:"
            f" give at most {highest:.4g} Hz (--cutoff)."
        )
    factor, least = _DIFFERENTIATION
    wide = settings.differentiation_cutoff_hz or max(factor * cutoff, least)
    parallel = settings.filter_torque
    motion = min(wide, highest) if parallel else cutoff
    order = settings.filter_order
    threshold = settings.velocity_threshold_rad_s
    body_every = max(1, int(rate / (_BODY_OVERSAMPLING * motion))) if parallel else 1
    row_every = max(1, int(rate / (_ROW_OVERSAMPLING * cutoff))) if parallel else 1
    return Processing(
        columns=Lowpass(cutoff, order, rate) if parallel else None,
        motion=Lowpass(motion, order, rate),
        sign=Lowpass(min(settings.sign_cutoff_hz, highest), order, rate),
        body_every=body_every,
        row_every=max(body_every, row_every - row_every % body_every),
        threshold_rad_s=0.0 if threshold == "auto" else threshold,
        delay_s=settings.delay_s or 0.0,
        curves=curves if parallel and settings.reversals == "auto" and arm.terms.coulomb else (),
        reason=reason,
    )


def _cutoff(arm: Arm, data: Dataset) -> tuple[float, str]:
    if arm.settings.cutoff_hz is not None:
        return arm.settings.cutoff_hz, "given"
    if arm.harmonic_hz is not None:
        text = f"{_OVER_HARMONIC} times the highest harmonic of the excitation (paper, V-C)"
        return _OVER_HARMONIC * arm.harmonic_hz, text
    wanted = min(wanted_cutoff_hz(data), highest_cutoff_hz(data))
    fitting = _lowest_cutoff_hz(arm, data)
    if wanted < fitting < highest_cutoff_hz(data):
        return fitting, "the lowest whose filter fits into the recording"
    text = f"{_OVER_HARMONIC} times the frequency below which {_ENERGY:.0%} of the velocity lies"
    return wanted, text


def wanted_cutoff_hz(data: Dataset) -> float:
    """The cut-off that the velocity's spectrum asks for [Hz]."""
    return _OVER_HARMONIC * highest_frequency(data)


def highest_cutoff_hz(data: Dataset) -> float:
    """The highest cut-off that is taken without being asked for [Hz]."""
    return _HIGHEST_SHARE * data.rate_hz / 2


def _lowest_cutoff_hz(arm: Arm, data: Dataset) -> float:
    """The lowest cut-off whose filter fits into the longest stretch [Hz]."""
    longest = max(span.length for span in data.spans) / data.rate_hz
    of_one_hertz = Lowpass(1.0, arm.settings.filter_order, data.rate_hz).time_constant_s
    return float(_TO_FIT * _LEAST_TRIMS * _TRIM * of_one_hertz / longest)


def highest_frequency(data: Dataset) -> float:
    """Frequency below which 99 % of the velocity's energy lies [Hz], of the liveliest joint."""
    velocity = np.diff(_excerpt(data)[:, data.moving], axis=0)
    window = np.hanning(len(velocity))[:, None]
    energy = np.abs(np.fft.rfft(velocity * window, axis=0)) ** 2
    share = np.cumsum(energy, axis=0) / energy.sum(axis=0)
    frequency = np.fft.rfftfreq(len(velocity), 1 / data.rate_hz)
    return float(max(frequency[np.argmax(column > _ENERGY)] for column in share.T))


def _excerpt(data: Dataset) -> Array:
    """Position in the first samples of the longest span, shape (S, n)."""
    longest = max(range(len(data.spans)), key=lambda k: data.spans[k].length)
    found, count = [], 0
    for number, part in data.read():
        if number == longest and count < _MOST_SAMPLES:
            found.append(part.q)
            count += len(part.q)
    return np.concatenate(found)[:_MOST_SAMPLES]
