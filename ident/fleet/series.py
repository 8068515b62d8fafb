"""One arm's logs in order of time: the test, and its parameters log by log."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from ident.fleet.arm_type import ArmType
from ident.fleet.candidates import Candidate, candidates
from ident.fleet.changes import Change, Detector, beside, changes, evidence, lasting
from ident.fleet.hierarchy import DAILY, TypeStatistics, log_information, louder, warmth
from ident.fleet.metadata import Said
from ident.fleet.normal import Information, LogData, nothing, posterior
from ident.fleet.settings import FleetSettings
from ident.fleet.store import Stored
from ident.fleet.triangles import unpacked
from ident.signals.arrays import Array


@dataclass(frozen=True)
class Entry(Said):
    """One log of an arm, with what is known of it.

    Attributes:
        stored: its reduction.
    """

    stored: Stored

    def data(self, reference_c: float) -> LogData:
        """Its triangles, read from disk."""
        reduced = self.stored.reduced
        joints, _ = unpacked(self.stored.triangles() or b"")
        warmer = self.warmer_k(reference_c)
        return LogData(joints, reduced.rows, reduced.rows_per_value, warmer)

    def warmer_k(self, reference_c: float) -> float:
        """Temperature beside a reference [K]; zero where it is not known."""
        return 0.0 if self.temperature_c is None else self.temperature_c - reference_c


@dataclass(frozen=True)
class Series:
    """What a worker needs to know of an arm.

    Attributes:
        arm: its name.
        entries: its logs of one type that can be used, in order of time.
        kind: the type.
        known: statistics of the type.
        settings: of the fleet.
        least_odds: logarithm of the odds from which a change is told.
    """

    arm: str
    entries: tuple[Entry, ...]
    kind: ArmType
    known: TypeStatistics
    settings: FleetSettings
    least_odds: float = np.inf

    @property
    def key(self) -> tuple[str, str]:
        """Names of arm and type."""
        return self.arm, self.entries[0].stored.reduced.type

    def information(self) -> list[Information]:
        """What each log says at the reference temperature."""
        return self.said([e.data(self.known.reference_c) for e in self.entries])

    def said(self, logs: Sequence[LogData]) -> list[Information]:
        """The same of any logs of the arm."""
        own = louder(logs, self.known.own)
        return [log_information(log, self.kind, self.known) for log in own]

    def candidates(self) -> tuple[Candidate, ...]:
        """What may change."""
        spread = np.sqrt(self.known.D)
        return candidates(self.kind, self.known.mean, spread, self.settings)

    def detector(self) -> Detector:
        """The test, before the first log."""
        known, s = self.known, self.settings
        return Detector(known.mean, known.D, self.candidates(), s.onsets, s.least_logs)


@dataclass(frozen=True)
class ArmResult:
    """What is said of an arm.

    Attributes:
        values, sds: of each log alone beside the type, at its temperature, each of shape (T, p).
        at_reference: the same values at the type's reference temperature, shape (T, p).
        levels, level_sds: of all logs up to each one, at the reference temperature, (T, p).
        changes: in the order in which they were told.
        log_odds: logarithm of the odds of a change after each log, shape (T,).
        smallest: changes that the latest logs would just tell, see `Detector.smallest`.
    """

    values: Array
    sds: Array
    at_reference: Array
    levels: Array
    level_sds: Array
    changes: tuple[Change, ...]
    log_odds: Array
    smallest: Array


@threadpool_limits.wrap(limits=1)
def highest_odds(series: Series) -> float:
    """Highest logarithm of the odds of a change that an arm has ever kept."""
    odds = evidence(series.information(), series.detector())
    return lasting(odds, series.settings.naming_logs)


@threadpool_limits.wrap(limits=1)
def result(series: Series) -> ArmResult:
    """All that is said of an arm."""
    known, logs, detector = series.known, series.information(), series.detector()
    odds = evidence(logs, detector)
    smallest = detector.smallest(series.settings.shown_logs, series.least_odds)
    told: list[Change] = []
    if lasting(odds, series.settings.naming_logs) >= series.least_odds:
        found = series.candidates()
        told = changes(logs, known.mean, known.D, found, series.least_odds, series.settings)
    cold, sds = _alone(series, logs)
    warmer = [e.warmer_k(known.reference_c) for e in series.entries]
    values = cold * [warmth(series.kind, known.slopes, k) for k in warmer]
    levels, level_sds = _levels(logs, known.mean, known.D, told)
    return ArmResult(values, sds, cold, levels, level_sds, tuple(told), odds, smallest)


def _alone(series: Series, logs: Sequence[Information]) -> tuple[Array, Array]:
    """Each log's own parameters at the reference temperature, and their standard errors."""
    known = series.known
    scatter = np.zeros(len(known.mean))
    scatter[series.kind.of_kinds(*DAILY)] = known.Q
    found = [posterior(log, known.mean, known.D) for log in logs]
    return (
        np.array([x for x, _ in found]),
        np.array([np.sqrt(np.diag(V) + scatter) for _, V in found]),
    )


def _levels(
    logs: Sequence[Information], mean: Array, variance: Array, told: Sequence[Change]
) -> tuple[Array, Array]:
    """The arm's parameters after each log, with its changes among them."""
    p = len(mean)
    ways = [(c.onset, c.candidate.V, c.candidate.usual**2) for c in told]
    logs, mean, variance = beside(logs, mean, variance, ways)
    said, levels, sds = nothing(len(mean)), [], []
    for number, log in enumerate(logs):
        said = said + log
        x, V = posterior(said, mean, variance)
        A = np.hstack([np.eye(p), *(way * float(number >= onset) for onset, way, _ in ways)])
        levels.append(A @ x)
        sds.append(np.sqrt(np.einsum("ij,jk,ik->i", A, V, A)))
    return np.array(levels), np.array(sds)
