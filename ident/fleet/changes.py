"""Whether, since when and in what an arm has changed: a test that may be looked at after every log.

The odds of each change (a candidate from an onset on, its size normal about zero) against none,
with the arm's own parameters integrated out under the type's prior, are a test martingale; so is
their mixture over onsets and candidates. It exceeds c ever with a chance of 1/c at most (Ville
1939; Ramdas, Grunwald, Vovk, Shafer 2023), however often it is looked at.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add

import numpy as np
import scipy.linalg
from scipy.special import logsumexp

from ident.fleet.candidates import Candidate
from ident.fleet.normal import Information, posterior
from ident.fleet.settings import FleetSettings
from ident.signals.arrays import Array

_RIVAL = 0.01  # of the odds: less likely names are not told
_NOTHING = 1e-12  # information on a change of usual size: rounding, where there is none


@dataclass(frozen=True)
class Change:
    """A change of one arm.

    Attributes:
        candidate: what changed.
        onset: number of the first log after it, from 0.
        onset_share: odds of that onset among all others.
        told: number of the log at which it was told.
        log_evidence: logarithm of the odds at which it was told.
        sizes, sds: of the candidate's numbers, each of shape (k,).
        size, sd: of the one that is reported, called `parameter`.
        rivals: name, joints, and share of the odds of others that explain it nearly as well.
    """

    candidate: Candidate
    onset: int
    onset_share: float
    told: int
    log_evidence: float
    sizes: Array
    sds: Array
    parameter: str
    unit: str
    size: float
    sd: float
    rivals: tuple[tuple[str, tuple[int, ...], float], ...]


@dataclass(frozen=True)
class Odds:
    """Logarithms of the odds after a log.

    Attributes:
        first: the earliest onset.
        single: by onset and candidate, priors of both included, shape (S, H).
    """

    first: int
    single: Array

    @property
    def whole(self) -> float:
        """Of any change against none."""
        return float(np.asarray(logsumexp(self.single))) if self.single.size else -np.inf


class Detector:
    """The test of one arm, log by log.

    Args:
        mean, variance: of the parameters before the first log, each of shape (p,).
        found: the candidates.
        onsets: how many of the latest logs a change may begin at.
        least: logs that come before any onset.
    """

    def __init__(
        self, mean: Array, variance: Array, found: Sequence[Candidate], onsets: int, least: int
    ) -> None:
        self._mean, self._precision = mean, 1.0 / variance
        self._candidates = tuple(found)
        self._onsets, self._least = onsets, least
        self._V = np.concatenate([c.V for c in found], axis=1)
        ends = np.cumsum([c.V.shape[1] for c in found])
        self._places = [
            np.arange(e - c.V.shape[1], e) for e, c in zip(ends, self._candidates, strict=True)
        ]
        self._N, self._y = np.diag(self._precision), self._precision * mean
        self._count = 0
        self._before: list[tuple[Array, Array]] = []
        self._NV = np.zeros_like(self._V)
        self._logs_y = np.zeros(len(mean))

    def add(self, log: Information) -> Odds:
        """The odds after one more log."""
        self.take(log)
        return self.odds()

    def take(self, log: Information) -> None:
        """One more log, without a look."""
        if self._count >= self._least:
            self._before.append((self._NV.copy(), self._logs_y.copy()))
        self._before = self._before[-self._onsets :]
        self._N, self._y = self._N + log.N, self._y + log.y
        self._NV, self._logs_y = self._NV + log.N @ self._V, self._logs_y + log.y
        self._count += 1

    def odds(self) -> Odds:
        """The odds after the logs so far."""
        first = self._count - len(self._before)
        if not self._before:
            return Odds(first, np.empty((0, len(self._candidates))))
        a, b = self._scores()
        single = np.column_stack([self._odds(a, b, k) for k in range(len(self._candidates))])
        onsets = first + np.arange(len(self._before), dtype=float)
        return Odds(first, single + self._prior(onsets)[:, None])

    def _prior(self, onset: Array) -> Array:
        """Logarithm of a candidate's share of the odds, by its onset."""
        number = onset - self._least + 1.0
        return -np.log(number * (number + 1.0)) - np.log(len(self._candidates))

    def smallest(self, logs: int, least_odds: float) -> Array:
        """Changes that the latest logs would just tell, in multiples of the usual size, (H,).

        Infinite where they say nothing of one; none is known (nan) with too few logs before them.

        Args:
            logs: so many.
            least_odds: logarithm of the odds that are asked for.
        """
        if len(self._before) < logs:
            return np.full(len(self._candidates), np.nan)
        inner = self._scores()[0][-logs]
        asked = least_odds - self._prior(np.array(self._count - logs, dtype=float))
        found = []
        for candidate, part in zip(self._candidates, self._places, strict=True):
            v = candidate.direction
            a = max(float(v @ inner[np.ix_(part, part)] @ v), _NOTHING)
            found.append(np.sqrt((2.0 * asked + np.log1p(a)) * (1.0 + a)) / a)
        return np.array(found)

    def _scores(self) -> tuple[Array, Array]:
        """Information on the candidates' numbers and score, by onset: (S, K, K) and (S, K)."""
        factor = scipy.linalg.cholesky(self._N, lower=True)
        x = scipy.linalg.cho_solve((factor, True), self._y)
        NV = np.stack([self._NV - old for old, _ in self._before])
        y = np.stack([self._logs_y - old for _, old in self._before])
        wide = np.moveaxis(NV, 0, 1).reshape(len(x), -1)
        solved = scipy.linalg.solve_triangular(factor, wide, lower=True)
        solved = np.moveaxis(solved.reshape(len(x), len(NV), -1), 1, 0)
        a = self._V.T @ NV - np.swapaxes(solved, 1, 2) @ solved
        return a, y @ self._V - np.einsum("spk,p->sk", NV, x)

    def _odds(self, a: Array, b: Array, k: int) -> Array:
        """Of one candidate at each onset, shape (S,)."""
        part, usual = self._places[k], self._candidates[k].usual
        inner = usual[:, None] * a[:, part[:, None], part] * usual + np.eye(len(part))
        right = usual * b[:, part]
        gain = np.einsum("sk,sk->s", right, np.linalg.solve(inner, right[..., None])[..., 0])
        return 0.5 * (gain - np.linalg.slogdet(inner)[1])


def evidence(logs: Sequence[Information], detector: Detector) -> Array:
    """Logarithm of the odds of any change after each further log of an arm, shape (T,)."""
    return np.array([detector.add(log).whole for log in logs])


def lasting(odds: Array, logs: int) -> float:
    """The highest odds (logarithm) that an arm keeps over so many further logs, or to the last.

    One odd day may seem a change until the next ones show the arm as it was.

    Args:
        odds: after each log, shape (T,).
        logs: so many.
    """
    kept = [odds[t : t + logs + 1].min() for t in range(len(odds))]
    return float(max(kept, default=-np.inf))


def changes(
    logs: Sequence[Information],
    mean: Array,
    variance: Array,
    found: Sequence[Candidate],
    least_odds: float,
    settings: FleetSettings,
) -> list[Change]:
    """The changes of an arm, one after the other.

    Each is told when the odds of any change exceed what is asked for, and go on to do so in the few
    logs that follow, with which it is named. The next is looked for after that, beside it, in an
    arm that may otherwise be any of its type since then: who changes a gearbox changes more than
    one number. Sizes come from all logs.

    Args:
        logs: of the arm, in order of time.
        mean: of its parameters before the first log, shape (p,).
        variance: the same, shape (p,).
        found: the candidates.
        least_odds: logarithm of the odds that are asked for.
        settings: of the fleet.
    """
    told: list[Change] = []
    ways: list[tuple[int, Array, Array]] = []
    least, seen, before, after = settings.least_logs, list(logs), mean, variance
    while len(told) < settings.changes:
        wide = [replace(c, V=_padded(c.V, len(before))) for c in found]
        detector = Detector(before, after, wide, settings.onsets, least)
        at, whole, odds = len(logs), 0.0, None
        for number, log in enumerate(seen):
            if number > at + settings.naming_logs:
                break
            odds = detector.add(log)
            if odds.whole < least_odds:
                at = len(logs)  # what the logs that follow take back is no change
            elif at == len(logs):
                at, whole = number, odds.whole
        if at == len(logs) or odds is None:
            break
        change = _named(odds, found, at, whole)
        told.append(change)
        least = at + 1
        ways.append((change.onset, np.eye(len(mean)), variance))
        ways.append((change.onset, change.candidate.V, change.candidate.usual**2))
        seen, before, after = beside(logs, mean, variance, ways)
    return _sized(told, logs, mean, variance)


def _padded(V: Array, count: int) -> Array:
    return np.vstack([V, np.zeros((count - len(V), V.shape[1]))])


def beside(
    logs: Sequence[Information],
    mean: Array,
    variance: Array,
    ways: Sequence[tuple[int, Array, Array]],
) -> tuple[list[Information], Array, Array]:
    """Logs, mean and variance with more numbers behind the arm's parameters.

    Args:
        logs: of the arm.
        mean: of its p parameters before them, shape (p,).
        variance: the same, shape (p,).
        ways: of each the first log that it is in, the change of the parameters per unit, shape
            (p, k), and its variance about zero, shape (k,).
    """
    wide = []
    for number, log in enumerate(logs):
        present = (V * float(number >= onset) for onset, V, _ in ways)
        A = np.hstack([np.eye(len(mean)), *present])
        wide.append(Information(A.T @ log.N @ A, A.T @ log.y))
    more = np.concatenate([v for _, _, v in ways]) if ways else np.empty(0)
    return wide, np.append(mean, np.zeros(len(more))), np.append(variance, more)


def _named(odds: Odds, found: Sequence[Candidate], at: int, whole: float) -> Change:
    """The most likely change, its size still unknown."""
    by_candidate = np.asarray(logsumexp(odds.single, axis=0))
    shares = np.exp(by_candidate - np.asarray(logsumexp(by_candidate)))
    best = int(np.argmax(shares))
    onsets = odds.single[:, best]
    s = int(np.argmax(onsets))
    others = [k for k in np.argsort(-shares) if k != best and shares[k] > _RIVAL]
    nothing = np.zeros(len(found[best].usual))
    return Change(
        candidate=found[best],
        onset=odds.first + s,
        onset_share=float(np.exp(onsets[s] - np.asarray(logsumexp(onsets)))),
        told=at,
        log_evidence=whole,
        sizes=nothing,
        sds=nothing,
        parameter="",
        unit="",
        size=0.0,
        sd=0.0,
        rivals=tuple((found[k].name, found[k].joints, float(shares[k])) for k in others),
    )


def _sized(
    told: Sequence[Change], logs: Sequence[Information], mean: Array, variance: Array
) -> list[Change]:
    """The changes with their sizes, by all logs and all changes together."""
    if not told:
        return []
    ways = [(c.onset, c.candidate.V, c.candidate.usual**2) for c in told]
    first = len(mean)
    logs, mean, variance = beside(logs, mean, variance, ways)
    x, V = posterior(reduce(add, logs), mean, variance)
    result = []
    for change in told:
        candidate = change.candidate
        here = slice(first, first + len(candidate.usual))
        first = here.stop
        sizes, covariance = x[here], V[here, here]
        sds = np.sqrt(np.diag(covariance))
        weights, name, unit = candidate.reported, candidate.reported_name, candidate.units[0]
        if not weights.any():
            surest = int(np.argmax(np.abs(sizes) / sds))
            weights = np.eye(len(sizes))[surest]
            name, unit = candidate.parameters[surest], candidate.units[surest]
        size, sd = float(weights @ sizes), float(np.sqrt(weights @ covariance @ weights))
        sd = float(np.hypot(sd, candidate.left_out * size**2))
        named = {"parameter": name, "unit": unit, "size": size, "sd": sd}
        result.append(replace(change, sizes=sizes, sds=sds, **named))
    return result


def least_log_odds(highest: Sequence[float], share: float) -> float:
    """Odds (logarithm) that an arm must reach so that few of those told are false.

    One over the highest odds that an arm has ever kept is a p-value that holds at every look;
    arms are independent given their type, so that the procedure of Benjamini and Hochberg (1995)
    keeps the expected share of false ones among those told.

    Args:
        highest: the highest logarithm of the odds of each arm.
        share: of false ones.
    """
    ordered = np.sort(np.asarray(highest))[::-1]
    asked = np.log(len(ordered)) - np.log(share) - np.log(np.arange(1, len(ordered) + 1))
    if not len(ordered):
        return np.inf
    passed = np.flatnonzero(ordered >= asked)
    return float(asked[passed[-1]] if len(passed) else asked[0])
