"""Tells when the trusted model no longer explains the arm, and by what."""

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from ident.effects.candidate import Value
from ident.fleet.candidates import Candidate
from ident.fleet.changes import Detector, Odds
from ident.fleet.normal import Information, nothing, posterior
from ident.model.identified_model import Model
from ident.signals.arrays import Array
from ident.watch.residual import FORCE, PAYLOAD, Residual, Window
from ident.watch.settings import WatchSettings


@dataclass(frozen=True)
class Alarm:
    """What is told.

    Attributes:
        since_ns, told_ns: where it began, and when it could be told [ns].
        kind: `payload`, `friction`, `contact` or `other`.
        joints: from 1; empty for load and push.
        evidence: logarithm of the odds against no change.
        parameters: sizes by name.
        rival: the next likely kind with its joints, where it has more than 5 % of the odds.
    """

    since_ns: int
    told_ns: int
    kind: str
    joints: tuple[int, ...]
    evidence: float
    parameters: dict[str, Value]
    rival: str


class Watcher:
    """The test over windows of motion; it begins anew after each block of them.

    Within a block the odds of a change are a test martingale; it exceeds c ever with a chance of
    1/c at most, so that c blocks in an hour over the false alarms wanted in one keeps these.

    Args:
        model: the trusted model.
        residual: what it leaves.
        settings: of the watch.
    """

    def __init__(self, model: Model, residual: Residual, settings: WatchSettings) -> None:
        self._settings = settings
        self._candidates = _candidates(model, residual, settings)
        self._variance = _trusted(model, residual, settings)
        self._mean = np.zeros(residual.count)
        self._begin()

    def _begin(self) -> None:
        onsets = self._settings.block_windows
        self.test = Detector(self._mean, self._variance, self._candidates, onsets, 0)
        self._windows: list[Window] = []
        self._crossed: int | None = None

    def look(self, window: Window) -> Alarm | None:
        """The alarm that a window brings, if it brings one."""
        if not window.moving:
            return None
        if len(self._windows) == self._settings.block_windows:
            self._begin()
        self._windows.append(window)
        odds = self.test.add(window.said)
        if self._crossed is None and odds.whole >= self._settings.least_log_odds:
            self._crossed = len(self._windows)
        last = self._settings.block_windows
        waited = len(self._windows) - (self._crossed or last)
        if self._crossed is None or (
            waited < self._settings.naming_windows and len(self._windows) < last
        ):
            return None
        alarm, candidate, since = self._named(odds)
        self._trust(candidate, since)
        self._begin()
        return alarm

    def _named(self, odds: Odds) -> tuple[Alarm, Candidate, int]:
        by_candidate = np.asarray(logsumexp(odds.single, axis=0))
        shares = np.exp(by_candidate - np.asarray(logsumexp(by_candidate)))
        order = np.argsort(-shares)
        best = self._candidates[order[0]]
        onset = odds.first + int(np.argmax(odds.single[:, order[0]]))
        sizes, V = self._sizes(best, onset)
        parts = zip(
            best.parameters, sizes.tolist(), np.sqrt(np.diag(V)).tolist(), best.units, strict=True
        )
        second = self._candidates[order[1]]
        rival = " ".join([second.name, *map(str, second.joints)])
        alarm = Alarm(
            since_ns=self._windows[onset].start_ns,
            told_ns=self._windows[-1].end_ns,
            kind=best.name,
            joints=best.joints,
            evidence=odds.whole,
            parameters={name: Value(*of_one) for name, *of_one in parts},
            rival=rival if shares[order[1]] > 0.05 else "",
        )
        return alarm, best, onset

    def _sizes(self, candidate: Candidate, onset: int) -> tuple[Array, Array]:
        """The candidate's numbers from the windows since its onset, and their covariance."""
        said = nothing(len(self._mean))
        for window in self._windows[onset:]:
            said = said + window.said
        A = np.hstack([np.eye(len(self._mean)), candidate.V])
        mean = np.append(self._mean, np.zeros(candidate.V.shape[1]))
        variance = np.append(self._variance, candidate.usual**2)
        x, V = posterior(Information(A.T @ said.N @ A, A.T @ said.y), mean, variance)
        k = len(self._mean)
        return x[k:], V[k:, k:]

    def _trust(self, candidate: Candidate, onset: int) -> None:
        """What has been told belongs to the arm from now on; a push is expected to end."""
        sizes, V = self._sizes(candidate, onset)
        if candidate.name == "contact":
            return
        self._mean = self._mean + candidate.V @ sizes
        self._variance = self._variance + np.diag(candidate.V @ V @ candidate.V.T)


def _trusted(model: Model, residual: Residual, settings: WatchSettings) -> Array:
    """How far the trusted model may be off without anybody being told, variances, shape (p,)."""
    share = settings.friction_share
    noise = np.where(np.isfinite(residual.noise), residual.noise, 1.0)
    fc, fv = np.abs(model.parameter("fc")), np.abs(model.parameter("fv"))
    load = settings.known_payload * _usual_load(settings)
    push = np.full(FORCE, 0.01 * settings.force_n)
    # friction that is modelled with motors has no number of its own at the joint
    viscous, dry = (np.maximum(share * x, 0.1 * noise) for x in (fv, fc))
    sds = np.concatenate([load, push, viscous, dry, 0.1 * noise])
    return sds**2


def _usual_load(settings: WatchSettings) -> Array:
    """Usual size of mass, first moments and inertia, shape (10,)."""
    kg, m = settings.payload_kg, settings.payload_m
    return np.array([kg, *[kg * m] * 3, *[kg * m * m] * 6])


def _candidates(model: Model, residual: Residual, settings: WatchSettings) -> tuple[Candidate, ...]:
    n, p = model.robot.dof, residual.count
    one = np.eye(p)
    none = np.zeros(0)

    def made(
        name: str,
        joints: tuple[int, ...],
        places: list[int],
        names: list[tuple[str, str]],
        usual: Array,
    ) -> Candidate:
        words, units = zip(*names, strict=True)
        return Candidate(name, joints, words, units, one[:, places], usual, none)

    moments = [(f"first_moment_{a}", "kg m") for a in "xyz"]
    inertia = [(f"inertia_{a}", "kg m^2") for a in ("xx", "xy", "xz", "yy", "yz", "zz")]
    load = made(
        "payload",
        (),
        list(range(PAYLOAD)),
        [("mass", "kg"), *moments, *inertia],
        _usual_load(settings),
    )
    push = made(
        "contact",
        (),
        list(range(PAYLOAD, PAYLOAD + FORCE)),
        [(f"force_{a}", "N") for a in "xyz"],
        np.full(FORCE, settings.force_n),
    )
    found = [load, push]
    fc, fv = np.abs(model.parameter("fc")), np.abs(model.parameter("fv"))
    first = PAYLOAD + FORCE
    for j in np.flatnonzero(model.moving).tolist():
        noise = residual.noise[j]
        sizes = np.array([max(settings.change_share * x, noise) for x in (fv[j], fc[j])])
        names = [(f"fv{j + 1}", "N m s/rad"), (f"fc{j + 1}", "N m")]
        found.append(made("friction", (j + 1,), [first + j, first + n + j], names, sizes))
        place = [first + 2 * n + j]
        name = [(f"torque{j + 1}", "N m")]
        found.append(made("other", (j + 1,), place, name, np.array([3.0 * noise])))
    return tuple(found)
