"""What arms of a type share: empirical Bayes by expectation and maximisation.

An arm's parameters x ~ N(mean, D), each log's own x + u with u ~ N(0, Q) for friction, and friction
is exp(k dT) times that at the reference temperature, with exponents k that the type shares; D and
Q are diagonal (Dempster, Laird, Rubin 1977; Laird, Ware 1982 for the model).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.fleet.arm_type import ArmType
from ident.fleet.normal import (
    Information,
    LogData,
    at_reference,
    information,
    nothing,
    posterior,
    without_scatter,
)
from ident.signals.arrays import Array

DAILY = ("fv", "fc", "fvm", "fcm", "fo", "stribeck")
"""Kinds that scatter from log to log."""

_SPREAD, _DAILY = 0.3, 0.03  # of a parameter's size, before anything is known
_LEAST = 1e-4  # of the same: no smaller spread is believed
_SMALL = 0.02  # of the torque: a parameter that makes less of it has this size
_ZERO_RAD = 0.01  # size of a joint's zero, which is none on average
_SLOPE = 0.02  # usual size of an exponent [1/K]: where temperature says nothing, there is none
_STEADY = 50.0  # independent values that say that an arm is as noisy as its type
_INNER = 4
_FEW = 4  # arms: with fewer, the spread between arms stays what it was supposed to be
_RIDGE = 1e-9


@dataclass(frozen=True)
class TypeStatistics:
    """What is known of a type.

    Attributes:
        mean, D: of arms, and their variance, each of shape (p,).
        Q: variance from log to log of the kinds in `DAILY`, shape (f,).
        slopes: relative change per kelvin of the groups of `ArmType.warm` [1/K], shape (w,).
        slopes_sd: their standard errors, shape (w,).
        noise: of each joint's torque in the median arm [N m], shape (n,).
        own: what a log's own fit leaves of it, in the same arm [N m], shape (n,).
        reference_c: temperature of the values [deg C].
        arms, logs: of how many this was learned.
    """

    mean: Array
    D: Array
    Q: Array
    slopes: Array
    slopes_sd: Array
    noise: Array
    own: Array
    reference_c: float
    arms: int
    logs: int


def louder(logs: Sequence[LogData], own: Array) -> list[LogData]:
    """The logs of an arm with its noise beside the type's.

    What a model of friction leaves depends on the arm and on its motion. An arm that is taken to be
    as quiet as the median one seems to change where it is only louder.

    Args:
        logs: of one arm.
        own: of the type, see `TypeStatistics`.
    """
    values = sum(np.asarray(log.rows) / log.rows_per_value for log in logs)
    squares = sum(log.squares / log.rows_per_value for log in logs)
    times = np.sqrt((_STEADY + squares / own**2) / (_STEADY + values))
    return [replace(log, louder=times) for log in logs]


def _own(arms: Sequence[Sequence[LogData]]) -> Array:
    """What a log's own fit leaves of each joint's torque in the median arm [N m], shape (n,)."""
    squares = np.array([np.sum([log.squares for log in logs], axis=0) for logs in arms])
    rows = np.array([np.sum([log.rows for log in logs], axis=0) for logs in arms])
    typical = np.sqrt(np.median(squares / np.maximum(rows, 1.0), axis=0))
    return np.where(typical > 0.0, typical, np.inf)


def log_information(log: LogData, kind: ArmType, known: TypeStatistics) -> Information:
    """What a log says of its arm's parameters at the reference temperature."""
    count = len(kind.names)
    said = information(log, known.noise, count)
    said = without_scatter(said, kind.of_kinds(*DAILY), known.Q)
    return at_reference(said, warmth(kind, known.slopes, log.warmer_k))


def warmth(kind: ArmType, slopes: Array, warmer_k: float) -> Array:
    """What the parameters are multiplied by when it is warmer, shape (p,)."""
    factors = np.ones(len(kind.names))
    for places, slope in zip(kind.warm, slopes, strict=True):
        factors[places] = np.exp(slope * warmer_k)
    return factors


def learned(
    arms: Sequence[Sequence[LogData]], kind: ArmType, reference_c: float, rounds: int
) -> TypeStatistics:
    """What some arms of a type tell of it.

    Args:
        arms: logs of each.
        kind: the type.
        reference_c: temperature from which `LogData.warmer_k` counts [deg C].
        rounds: of expectation and maximisation.
    """
    own = _own(arms)
    arms = [louder(logs, own) for logs in arms]
    now, size = _start(arms, kind, reference_c, own)
    for _ in range(rounds):
        sums = [_summed(logs, kind, now) for logs in arms]
        for _ in range(_INNER):
            now = _arms_step(now, sums, size, kind)
        now = _slopes_step(now, arms, sums, kind)
        now = _logs_step(now, arms, kind, size)
    return _with_error(now, [_summed(logs, kind, now) for logs in arms], size)


def _start(
    arms: Sequence[Sequence[LogData]], kind: ArmType, reference_c: float, own: Array
) -> tuple[TypeStatistics, Array]:
    """Where the rounds begin, and the size of each parameter, shape (p,)."""
    logs = [log for arm in arms for log in arm]
    p, n = len(kind.names), len(kind.joints)
    gram, rows = np.zeros((n, p + 1, p + 1)), np.zeros(n)
    for log in logs:
        rows += log.rows
        for t in log.joints:
            gram[t.joint][np.ix_(t.used, t.used)] += t.R.T @ t.R
    torque = np.sqrt(gram[:, -1, -1] / np.maximum(rows, 1.0))
    total = gram.sum(axis=0)
    scale = np.sqrt(np.diag(total)[:-1])
    seen = scale > 0.0
    seen[kind.of_kinds("zero")] = False
    scale = np.where(seen, scale, 1.0)
    within = np.ix_(seen, seen)
    normal = (total[:-1, :-1] / scale[:, None] / scale)[within] + _RIDGE * np.eye(seen.sum())
    mean = np.zeros(p)
    mean[seen] = np.linalg.solve(normal, (total[:-1, -1] / scale)[seen]) / scale[seen]
    size = np.maximum(np.abs(mean), _SMALL * np.sqrt(total[-1, -1]) / scale)
    size[kind.of_kinds("zero")] = _ZERO_RAD
    noise = np.sqrt(np.array([_error(g, mean) for g in gram]) / np.maximum(rows, 1.0))
    daily = kind.of_kinds(*DAILY)
    start = TypeStatistics(
        mean=mean,
        D=(_SPREAD * size) ** 2,
        Q=(_DAILY * size[daily]) ** 2,
        slopes=np.zeros(len(kind.warm)),
        slopes_sd=np.zeros(len(kind.warm)),
        noise=np.maximum(noise, 1e-4 * np.maximum(torque, 1e-12)),
        own=own,
        reference_c=reference_c,
        arms=len(arms),
        logs=len(logs),
    )
    return start, size


def _error(gram: Array, x: Array) -> float:
    v = np.append(-x, 1.0)
    return max(float(v @ gram @ v), 0.0)


def _summed(logs: Sequence[LogData], kind: ArmType, now: TypeStatistics) -> Information:
    said = nothing(len(kind.names))
    for log in logs:
        said = said + log_information(log, kind, now)
    return said


def _arms_step(
    now: TypeStatistics, sums: Sequence[Information], size: Array, kind: ArmType
) -> TypeStatistics:
    """Mean and variance of arms."""
    found = [posterior(said, now.mean, now.D) for said in sums]
    means = np.array([m for m, _ in found])
    mean = means.mean(axis=0)
    mean[kind.of_kinds("zero")] = 0.0
    if len(sums) < _FEW:
        return replace(now, mean=mean)
    spare = np.array([np.diag(V) for _, V in found])
    freedom = max(len(sums) - 1, 1) / len(sums)
    D = np.mean((means - mean) ** 2 / freedom + spare, axis=0)
    return replace(now, mean=mean, D=np.maximum(D, (_LEAST * size) ** 2))


def _with_error(now: TypeStatistics, sums: Sequence[Information], size: Array) -> TypeStatistics:
    """The variance between arms with its standard error on top, for it is the likeliest value.

    Few arms, or arms whose motion hardly shows a parameter, tell it roughly, and what borrows from
    a type that seems too narrow is too sure. An arm weighs as much as its own data decide.
    """
    if len(sums) < _FEW:
        return now
    spare = np.array([np.diag(posterior(said, now.mean, now.D)[1]) for said in sums])
    weight = np.sum((1.0 - spare / now.D) ** 2, axis=0)
    error = now.D * np.sqrt(2.0 / np.maximum(weight, 1e-300))
    most = np.maximum(now.D, (_SPREAD * size) ** 2)
    return replace(now, D=np.minimum(now.D + error, most))


def _slopes_step(
    now: TypeStatistics,
    arms: Sequence[Sequence[LogData]],
    sums: Sequence[Information],
    kind: ArmType,
) -> TypeStatistics:
    """Exponents over temperature: a Newton step with each arm's own parameters profiled out."""
    groups = np.zeros((len(now.mean), len(kind.warm)))
    for k, places in enumerate(kind.warm):
        groups[places, k] = 1.0
    A, r = np.diag(np.full(len(kind.warm), _SLOPE**-2.0)), -now.slopes / _SLOPE**2
    for logs, said in zip(arms, sums, strict=True):
        x, V = posterior(said, now.mean, now.D)
        across, own = np.zeros_like(groups), np.zeros_like(A)
        for log in logs:
            one = log_information(log, kind, now)
            change = log.warmer_k * groups * x[:, None]
            across += one.N @ change
            own += change.T @ one.N @ change
            r = r + change.T @ (one.y - one.N @ x)
        A += own - across.T @ V @ across
    inverse = np.linalg.inv(A)
    return replace(now, slopes=now.slopes + inverse @ r, slopes_sd=np.sqrt(np.diag(inverse)))


def _logs_step(
    now: TypeStatistics, arms: Sequence[Sequence[LogData]], kind: ArmType, size: Array
) -> TypeStatistics:
    """Variance from log to log, and noise: of the median arm, whatever a few have met with."""
    daily = kind.of_kinds(*DAILY)
    n, p = len(kind.joints), len(now.mean)
    scatter, variances = [], []
    for logs in arms:
        squares, errors, rows = np.zeros(len(daily)), np.zeros(n), np.zeros(n)
        x, V = posterior(_summed(logs, kind, now), now.mean, now.D)
        for log in logs:
            said = information(log, now.noise, p)
            factors = warmth(kind, now.slopes, log.warmer_k)
            G = np.linalg.inv(said.N[np.ix_(daily, daily)] + np.diag(1.0 / now.Q))
            pull = G @ said.N[daily] * factors
            u = G @ said.y[daily] - pull @ x
            squares += u**2 + np.diag(G) + np.einsum("ij,jk,ik->i", pull, V, pull)
            full = factors * x
            full[daily] += u
            v = np.append(-full, 1.0)
            for t in log.joints:
                errors[t.joint] += np.sum((t.R @ v[t.used]) ** 2)
            rows += log.rows
        scatter.append(squares / len(logs))
        errors /= np.maximum(rows, 1.0) * logs[0].times(np.ones(n)) ** 2
        variances.append(np.where(rows > 0, errors, now.noise**2))
    Q = np.maximum(np.median(scatter, axis=0), (_LEAST * size[daily]) ** 2)
    noise = np.sqrt(np.median(variances, axis=0))
    return replace(now, Q=Q, noise=np.maximum(noise, 1e-12))
