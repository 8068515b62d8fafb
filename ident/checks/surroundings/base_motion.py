"""A base that moves: gravity seems to swing, and all joints feel it at once."""

from dataclasses import replace

import numpy as np

from ident.checks.case import Case
from ident.checks.remark import Grade, Remark
from ident.checks.settings import CheckSettings
from ident.dynamics.parameters import Terms, standard_parameters
from ident.dynamics.regressor import Motion, smooth_columns
from ident.regression.probe_fit import Columns, solution
from ident.signals.arrays import Array

_ADVICE = "Fasten the base and record again."
_LEAST_HZ, _MOST_HZ = 0.1, 3.0
_OF_CUTOFF = 0.2
"""Of the probe's cut-off: slower sways are not told from what a model lacks, which has the motion's
own frequencies."""

_PER_BIN = 2.0
"""Frequencies that are tried for each that the recording tells apart."""

_LEAST_JOINTS = 3
"""With fewer, the three directions of a sway could stand in for anything."""

_MOST_FREQUENCIES = 200


def base_remarks(case: Case, bounds: CheckSettings) -> list[Remark]:
    """Whether one oscillation of the base explains most of what is left of the torque."""
    if case.total < bounds.sway_error or case.probe.moving.sum() < _LEAST_JOINTS:
        return []
    frequencies, shares = _spectrum(case)
    best = int(np.argmax(shares))
    frequency, share = float(frequencies[best]), float(shares[best])
    if share < max(bounds.sway_share, bounds.sway_peak * float(np.median(shares))):
        return []
    text = (
        f"The base appears to sway at {frequency:.2g} Hz, which accounts for {100 * share:.0f} % of"
        f" the torque that the arm itself leaves unexplained ({100 * case.total:.3g} %)."
    )
    return [Remark("base_moves", (), text, Grade.DOUBTFUL, _ADVICE)]


def _spectrum(case: Case) -> tuple[Array, Array]:
    """Frequencies [Hz], and the share of the residual that a base swaying at each explains."""
    pull = _pull(case)
    residual, t = case.residual, case.probe.t
    fixed = pull.transpose(1, 0, 2).reshape(-1, 3)
    goal = residual.T.ravel()
    logs = np.tile(case.probe.log, residual.shape[1])
    first = case.probe.log == case.probe.log[0]
    seconds = float(np.ptp(t[first]))
    times = np.tile(t, residual.shape[1])
    least = max(_LEAST_HZ, _OF_CUTOFF * case.probe.cutoff_hz)
    count = int(min(_MOST_FREQUENCIES, _PER_BIN * seconds * (_MOST_HZ - least)))
    total = float(goal @ goal)
    frequencies = np.linspace(least, _MOST_HZ, max(count, 2))
    explained = np.zeros(len(frequencies))
    for i, f in enumerate(frequencies):
        waves = [fixed * w(2 * np.pi * f * times)[:, None] for w in (np.cos, np.sin)]
        for log in np.unique(logs):
            inside = logs == log
            X = np.concatenate([w[inside] for w in waves], axis=1)
            y = X.T @ goal[inside]
            explained[i] += float(y @ solution(X.T @ X, y))
    return frequencies, explained / max(total, 1e-300)


def _pull(case: Case) -> Array:
    """Torque per acceleration of the base along x, y, z [N m s^2/m], shape (S, n, 3)."""
    c: Columns = case.columns
    rows = c.W.reshape(-1, c.W.shape[-1])
    beta = solution(rows.T @ rows, rows.T @ c.tau.ravel())
    body = Terms(False, False, False, False, case.terms.drive_matrix, False)
    parameters = standard_parameters(case.robot, body)
    fitted = standard_parameters(case.robot, replace(body, rotor_inertia=True))
    places = [i for i, p in enumerate(fitted) if p.kind == "inertial"]
    still = np.zeros_like(case.probe.motion.q)
    motion = Motion(case.probe.motion.q, still, still)
    found = []
    for axis in np.eye(3):
        robot = case.with_gravity(axis).robot
        columns = smooth_columns(robot, body, motion, parameters)
        found.append((columns @ beta[places]) * case.probe.counted)
    return np.stack(found, axis=2)
