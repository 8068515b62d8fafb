"""An arm that recorded torque drives, fitted to where it was: output error, by Gauss-Newton."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.output_error.driven.columns import DrivenArm, Moved, columns
from ident.output_error.parameters import QUANTITIES
from ident.output_error.setup import MEMORY_S, Setup
from ident.output_error.uncertainty import alike, jackknifed
from ident.signals.arrays import Array

_DAMPED = 1e-4
_LEAST_DAMPED = 1e-8
_ATTEMPTS = [(part, 10.0**k) for k in range(0, 6, 2) for part in (1.0, 0.3, 0.1)]
"""Part of a step, and times the damping: a whole step may leave links that no arm can have, with
which a simulation runs away."""

_LONGEST = 1.5  # step of a logarithm
_FAR = 30.0  # of another coordinate
_ENOUGH = 1e-3  # nats per sample and joint
_LOOSE = 1e-9  # of a parameter's own information: what the motion does not tell stays
_BLOCK_S = 2.0
_PRIOR_SD = 3.0  # of a logarithm
_WIDE_SD = 30.0  # of another coordinate
_FLOOR = 1e-6  # rad


@dataclass(frozen=True)
class DrivenFit:
    """A fit's end.

    Attributes:
        beta: base parameters, shape (b,).
        settings: friction and gears, rows as `QUANTITIES` has them, shape (quantities, n).
        links: standard parameters of the links, shape (10 n,).
        further: settings that were fitted beside the base parameters.
        residuals: measured less simulated positions [rad], shape (S, n).
        columns: change of the simulated positions per parameter, shape (b + len(further), S, n).
        rounds: steps that were taken.
    """

    beta: Array
    settings: Array
    links: Array
    further: tuple[Moved, ...]
    residuals: Array
    columns: Array
    rounds: int

    @property
    def rms(self) -> Array:
        """Of the residuals by joint [rad], shape (n,)."""
        return np.sqrt(np.mean(self.residuals**2, axis=0))


class _Normal:
    """Columns and residuals in units of the residuals' rms, columns of unit length."""

    def __init__(self, setup: Setup, found: DrivenFit) -> None:
        usual = np.maximum(found.rms, floor_of(setup))
        made = found.columns / usual
        self.size = np.sqrt(np.maximum(np.einsum("asj,asj->a", made, made), 1e-300))
        self.columns = made / self.size[:, None, None]
        self.left = found.residuals / usual
        self.hessian = np.einsum("asj,bsj->ab", self.columns, self.columns, optimize=True)
        self.hessian += _LOOSE * np.eye(len(made))
        sd = np.array([_WIDE_SD if m.unit else _PRIOR_SD for m in found.further])
        samples = len(self.left) * MEMORY_S / setup.seconds  # that say the same
        self.belief = np.zeros(len(made))
        self.belief[len(found.beta) :] = samples / sd**2
        self.belief /= self.size**2
        self.known = self.hessian + np.diag(self.belief)

        self.slope = np.einsum("asj,sj->a", self.columns, self.left, optimize=True)


def fitted(
    arm: DrivenArm,
    beta: Array,
    settings: Array,
    further: Sequence[Moved] = (),
    rounds: int = 8,
    progress: Callable[[float], None] | None = None,
) -> DrivenFit:
    """The base parameters, and further settings, that follow the recordings best.

    Args:
        arm: arm and recordings.
        beta: where to begin, shape (b,).
        settings: friction and gears, shape (quantities, n); what beta holds is taken from there.
        further: settings to fit beside it.
        rounds: times that columns are formed, at most.
        progress: hears the share that is done.
    """
    floor, moved = floor_of(arm.setup), np.zeros(len(further))
    longest = np.array([_FAR if m.unit else _LONGEST for m in further])
    found, start = _simulated(arm, beta, settings, tuple(further)), settings
    damping, cost = _DAMPED, _cost(found.residuals, floor)
    kept, fresh = False, False  # columns serve two steps where the first helps
    for k in range(2 * rounds):
        if not kept:
            found, fresh = replace(found, columns=_columns(arm, found)), True
        normal, before = _Normal(arm.setup, found), cost
        away = np.concatenate([np.zeros(len(beta)), moved * normal.size[len(beta) :]])
        for part, lift in _ATTEMPTS:
            lifted = normal.known + lift * damping * np.eye(len(away))
            step = part * np.linalg.solve(lifted, normal.slope - normal.belief * away) / normal.size
            turn = moved + np.clip(step[len(beta) :], -longest, longest)
            new = found.settings.copy()
            for m, x in zip(further, turn, strict=True):
                new[m.place] = m.at(start[m.place], x)
            trial = _simulated(arm, found.beta + step[: len(beta)], new, found.further)
            now = _cost(trial.residuals, floor)
            if np.isfinite(now) and now < cost:
                found = replace(trial, columns=found.columns, rounds=found.rounds + 1)
                cost, moved, fresh = now, turn, False
                damping = max(lift * damping / 5.0, _LEAST_DAMPED)
                break
        if progress is not None:
            progress((k + 1) / (2 * rounds))
        helped = before - cost > _ENOUGH * len(floor)
        if not (helped or kept):
            break
        kept = helped and not kept
    return found if fresh else replace(found, columns=_columns(arm, found))


def floor_of(setup: Setup) -> Array:
    """Positions that are told in steps come no nearer than these allow [rad], shape (n,)."""
    return np.maximum(setup.resolution / np.sqrt(12.0), _FLOOR)


def covariance(arm: DrivenArm, found: DrivenFit) -> Array:
    """Of the fitted parameters, by chance and by the model's form, shape (p, p)."""
    normal = _Normal(arm.setup, found)
    blocks = max(int(arm.setup.seconds / _BLOCK_S), 8)
    spread = jackknifed(normal.columns, normal.left, normal.known, blocks)
    inverse = np.linalg.inv(normal.known)
    for j, speed in enumerate(_speeds(arm.setup).T):
        spread += inverse @ alike(normal.columns[:, :, j] * normal.left[:, j], speed) @ inverse
    return spread / np.outer(normal.size, normal.size)


def left_out(arm: DrivenArm, found: DrivenFit, group: NDArray[np.int64]) -> tuple[Array, Array]:
    """Each group of samples predicted from all others, in first order.

    Args:
        arm: arm and recordings.
        found: their fit.
        group: of each counted sample, from 0, shape (S,).

    Returns:
        residuals [rad], shape (S, n), and base parameters without each group, shape (G, b).
    """
    normal, made, betas = _Normal(arm.setup, found), found.residuals.copy(), []
    for g in range(int(group.max()) + 1):
        mine = group == g
        own = normal.columns[:, mine].reshape(len(normal.size), -1)
        slope = own @ normal.left[mine].ravel()
        step = np.linalg.solve(normal.known - own @ own.T, slope) / normal.size
        made[mine] += np.einsum("asj,a->sj", found.columns[:, mine], step, optimize=True)
        betas.append(found.beta - step[: len(found.beta)])
    return made, np.array(betas)


def _simulated(
    arm: DrivenArm, beta: Array, settings: Array, further: tuple[Moved, ...]
) -> DrivenFit:
    low, high = (np.array([[getattr(q, side)] for q in QUANTITIES]) for side in ("low", "high"))
    made = np.clip(arm.settings_with(beta, settings, further), low, high)
    links = arm.links_of(beta)
    left = replace(arm.setup, delta=links).residuals(made)
    return DrivenFit(beta, made, links, further, left, np.zeros(0), 0)


def _columns(arm: DrivenArm, found: DrivenFit) -> Array:
    return columns(arm, found.links, found.settings, found.further)


def _cost(residuals: Array, floor: Array) -> float:
    return float(np.sum(np.log(np.maximum(np.mean(residuals**2, axis=0), floor**2))))


def _speeds(setup: Setup) -> Array:
    """Of the recorded joints at the counted samples [rad/s], shape (S, n)."""
    made = [np.gradient(s.q, s.motion.t, axis=0)[s.counted :] for s in setup.segments]
    return np.concatenate(made)
