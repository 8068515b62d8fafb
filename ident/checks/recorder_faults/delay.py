"""Torque that comes later or earlier than the motion that it belongs to.

Torque and motion of one instant obey one law; of two instants they obey it the worse, the farther
apart these are. So the torque is moved along, and the arm fitted anew: where the least is left lies
the delay. It is believed if stretches of the recording agree on it, and if much less is left than
without it: what a model lacks (rotors, elasticity) may look like a small delay, but moving the
torque then mends little. A joint that turns round sticks meanwhile, and its torque changes before
its velocity does, as if it were early; so the instants in which joints slide must show the delay
by themselves, and all of them as well. The former's is told; how far the two lie apart is part of
its error. Delays of drives and filters are no fault of a recording,
and are left to `ident gap`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.checks.case import Case
from ident.checks.remark import Grade, Remark, joints, numbers
from ident.checks.settings import CheckSettings
from ident.identification.torque_delay import Delay
from ident.regression.probe import Chunk, Probe, shifted_torque
from ident.regression.probe_fit import Columns, held_out_residuals, weights_of
from ident.signals.arrays import Array

_DELAYS_S = (0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.65, 0.8, 1.0)
_LONGEST = 0.1
"""Of the shortest chunk: so much is lost at each end to what a shift leaves without torque."""

_FINE = 0.006
"""Steps in which a delay is looked for once it is known where it lies [s]."""

_COARSE, _NARROWER = 0.15, 0.4
"""The first steps towards that place, as a share of the delay, and how they shrink [1]."""

_MOST_STEPS = 12
"""Times that the place is moved, or the steps are made smaller."""

_STRETCHES = 12
_SHORTEST_S = 3e-3
"""Of a delay that is told [s]."""


@dataclass(frozen=True)
class Lag:
    """Where torque and motion agree best.

    Attributes:
        joint: whose torque alone was moved, from 0; None: that of all joints.
        seconds: the torque was recorded so much later than the motion.
        sd: its standard error, by leaving out stretches [s].
        ratio: what it leaves of the error that is there without it, the joints' geometric mean.
        error_ratio: the same of the error over all joints, as `Case.error` has it.
        known_s: the delay that is set already, which was taken off before.
    """

    joint: int | None
    seconds: float
    sd: float
    ratio: float
    error_ratio: float
    known_s: float = 0.0

    def believed(self, bounds: CheckSettings) -> bool:
        """Whether it is a fault of the recording; a ratio of one is none."""
        most = bounds.late_ratio if self.joint is None else bounds.late_alone
        return self._lowers_to(most, bounds)

    def borne_out(self, bounds: CheckSettings) -> bool:
        """Whether instants in which joints may stick do not speak against it."""
        return self._lowers_to(bounds.late_ratio, bounds)

    def _lowers_to(self, most: float, bounds: CheckSettings) -> bool:
        sure = abs(self.seconds) > bounds.late_deviations * self.sd
        return sure and abs(self.seconds) > bounds.late_s and self.ratio < most

    def remark(self, names: Sequence[str]) -> Remark:
        """What is said of it."""
        whose = "" if self.joint is None else f" of {joints([self.joint], names)}"
        way = "lags" if self.seconds > 0 else "leads"
        error = "the joints' error" if self.joint is None else "its error"
        text = (
            f"The torque{whose} {way} the motion by about {abs(self.seconds):.2g} s (±"
            f" {self.sd:.1g} s; without that, {error} falls to {100 * self.ratio:.0f} % of what it"
            " is)."
        )
        advice = "Stamp position and torque when they are sampled"
        if self.joint is None:
            value = f"{self.known_s - self.seconds:.2g}"
            advice += f", or set delay_s: {value} in the identification section of the arm's file"
        places = () if self.joint is None else numbers([self.joint])
        return Remark("late_torque", places, text, Grade.DOUBTFUL, f"{advice}.")


def lag(
    case: Case, chunks: Sequence[Chunk], bounds: CheckSettings, known_s: float = 0.0
) -> Lag | None:
    """Torque of another instant that fits the motion far better: of all joints, or of one.

    Args:
        case: the arm beside the recording.
        chunks: of the recording.
        bounds: of the checks.
        known_s: the delay that is set already, and taken off the chunks.
    """
    longest = _LONGEST * min(len(c.q) / c.rate_hz for c in chunks)
    later = [d for d in _DELAYS_S if d < longest]
    if not later:
        return None
    delays = np.array([*(-d for d in reversed(later)), 0.0, *later])
    whole = _shifted(case, chunks, delays)
    slides = _sliding(case.probe, bounds)
    if whole is None or not (sliding := whole.only(slides)).has_torque:
        return None
    found = _believed(sliding, bounds)
    if found is None or not whole.lag(found.joint).borne_out(bounds):
        return None
    told, step = found, max(_COARSE * abs(found.seconds), _FINE)
    for _ in range(_MOST_STEPS):
        about = told.seconds
        near = np.unique([0.0, *(about + step * np.arange(-2, 3))])
        if (finer := _shifted(case, chunks, near)) is None:
            return None
        told = agreed(finer.only(slides).lag(found.joint), finer.lag(found.joint))
        if abs(told.seconds - about) < step:
            if step == _FINE:
                break
            step = max(_NARROWER * step, _FINE)
    return replace(told, known_s=known_s) if told.borne_out(bounds) else None


def agreed(sliding: Lag, everywhere: Lag) -> Lag:
    """The delay of the instants in which joints slide; that of all is a part of its error."""
    apart = everywhere.seconds - sliding.seconds
    return replace(everywhere, seconds=sliding.seconds, sd=float(np.hypot(sliding.sd, apart)))


def _shifted(case: Case, chunks: Sequence[Chunk], delays: Array) -> "_Shifted | None":
    """Torque of other instants beside the motion; None where too little of it is left."""
    taus, inside = shifted_torque(chunks, case.probe, delays.tolist())
    taus = np.where(case.probe.counted, taus, 0.0)
    columns = replace(case.columns, W=case.columns.W * inside[:, None, None])
    made = _Shifted(columns, delays, taus, inside)
    return made if inside.sum() >= _STRETCHES and made.has_torque else None


def late_by_fit(found: Delay, name: str, bounds: CheckSettings) -> list[Remark]:
    """What is said of a delay that moving the torque hardly mends, but the fit's leftover shows.

    A long one, as where torque or positions alone were filtered, or one that explains much of the
    leftover. A filter delays what passes it: torque that leads is that of filtered positions.

    Args:
        found: the delay beside the fit.
        name: of the recording.
        bounds: of the checks.
    """
    size = abs(found.seconds)
    if size < bounds.late_deviations * found.sd:
        return []
    way = "leads" if found.seconds > 0 else "lags"
    told = f"{way} the motion by about {size:.2g} s (± {found.sd:.1g} s)"
    if size >= bounds.late_by_fit_s:
        text = f"{name}: what the model leaves is that of torque which {told}"
        if found.seconds > 0:
            text += ", as where positions were filtered alone, or where two clocks give the stamps."
            advice = (
                "Record positions without a filter, or filter the torque by the same one, and stamp"
                " both by one clock."
            )
        else:
            text += ", as torque that was filtered alone does."
            advice = "Record the torque without a filter, or filter positions by the same one."
    elif size >= _SHORTEST_S and found.explained >= bounds.late_by_fit_share:
        text = f"{name}: {100 * found.explained:.0f} % of the squares that the model leaves are"
        text += f" those of torque which {told}."
        advice = (
            "Let `ident gap` size the delay, and set delay_s in the identification section of the"
            " arm's file."
        )
    else:
        return []
    return [Remark("late_torque", (), text, Grade.DOUBTFUL, advice)]


def _sliding(probe: Probe, bounds: CheckSettings) -> NDArray[np.bool_]:
    """Where each joint is faster than where it may stick, shape (S, n)."""
    speed = np.abs(probe.motion.qd)
    return speed > bounds.slides_speed * np.sqrt(np.mean(speed**2, axis=0))


@dataclass(frozen=True)
class _Shifted:
    """Torque of other instants beside one motion.

    Attributes:
        columns: the regression; zero at instants that are not inside.
        delays: that are tried, D of them [s].
        taus: torque recorded so much later [N m], shape (D, S, n).
        inside: instants of which all of it was recorded, shape (S,).
    """

    columns: Columns
    delays: Array
    taus: Array
    inside: NDArray[np.bool_]

    @property
    def has_torque(self) -> bool:
        """Whether there is torque as recorded, at instants that are inside."""
        return bool(self.taus[self.delays == 0.0][:, self.inside].any())

    def only(self, rows: NDArray[np.bool_]) -> "_Shifted":
        """The same of some instants of each joint, shape (S, n)."""
        W, tau = self.columns.W * rows[:, :, None], self.columns.tau * rows
        columns = replace(self.columns, W=W, tau=tau)
        return replace(self, columns=columns, taus=self.taus * rows)

    def lag(self, joint: int | None = None, others_than: int | None = None) -> Lag:
        """The delay that leaves least of a joint's torque, or of all joints', or all but one's."""
        now = self.taus[self.delays == 0.0]
        taus = self.taus
        if joint is not None:
            taus = np.tile(now, (len(self.delays), 1, 1))
            taus[:, :, joint] = self.taus[:, :, joint]
        weights = weights_of(self.columns.tau)
        left = held_out_residuals(self.columns, taus, weights)[:, self.inside] ** 2
        size = np.sum(now[0, self.inside] ** 2, axis=0)
        used = size > 0
        shares = left.sum(axis=1)[:, used] / size[used]
        judged = used & (np.arange(len(used)) != others_than)
        left = left[:, :, judged if joint is None else [joint]]
        stretch = np.arange(left.shape[1]) * _STRETCHES // left.shape[1]
        parts = np.array([left[:, stretch == s].sum(axis=1) for s in range(_STRETCHES)])
        return _least(joint, self.delays, parts, shares)


def _believed(shifted: _Shifted, bounds: CheckSettings) -> Lag | None:
    """A delay of all joints, or of the one that it explains most, where the others show none."""
    together = shifted.lag()
    moving = np.flatnonzero(shifted.columns.tau.any(axis=0)).tolist()
    of_all = together if together.believed(bounds) else None
    if len(moving) == 1:
        return of_all
    believed = [one for one in map(shifted.lag, moving) if one.believed(bounds)]
    alone = min(believed, key=lambda one: one.ratio, default=None)
    if of_all and alone and shifted.lag(others_than=alone.joint).believed(bounds):
        return of_all
    return alone or of_all


def _least(joint: int | None, delays: Array, parts: Array, shares: Array) -> Lag:
    """Where the least is left, how surely, and how little.

    Args:
        joint: whose torque alone was moved.
        delays: that were tried, D of them [s].
        parts: squares that are left in each stretch, by delay and joint [N^2 m^2].
        shares: the same of all stretches and joints beside their torque, shape (D, joints).
    """
    total = parts.sum(axis=0)
    without = np.array([_lowest(delays, total - part) for part in parts])
    spread = (_STRETCHES - 1) / _STRETCHES * np.sum((without - without.mean()) ** 2)
    error, k, still = _mean_log(total), int(np.argmin(_mean_log(total))), delays == 0.0
    at_end = k in (0, len(delays) - 1)  # beyond it less may be left: no delay, but no dependence
    ratio = 1.0 if at_end else float(np.exp(error[k] - error[still][0]))
    overall = float(np.sqrt(shares[k].mean() / max(shares[still][0].mean(), 1e-300)))
    return Lag(joint, _lowest(delays, total), float(np.sqrt(spread)), ratio, overall)


def _mean_log(squares: Array) -> Array:
    """Logarithm of the joints' geometric mean error, shape (D,)."""
    return 0.5 * np.log(np.maximum(squares, 1e-300)).mean(axis=1)


def _lowest(delays: Array, squares: Array) -> float:
    """Where the error is least, between the delays by the parabola through three of them."""
    left = _mean_log(squares)
    k = int(np.argmin(left))
    if k in (0, len(delays) - 1):
        return float(delays[k])
    near = slice(k - 1, k + 2)
    curve, slope, _ = np.polyfit(delays[near] - delays[k], left[near], 2)
    return float(delays[k] - slope / (2 * curve)) if curve > 0 else float(delays[k])
