"""Torque that comes much later or earlier than the motion that it belongs to."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.checks.case import Case
from ident.checks.remark import Grade, Remark
from ident.checks.settings import CheckSettings
from ident.regression.probe import Chunk

_DELAYS_S = (0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.65, 0.8, 1.0)


def delay_remarks(case: Case, chunks: Sequence[Chunk], bounds: CheckSettings) -> list[Remark]:
    """Whether torque of another instant, the same for all joints, fits the motion far better."""
    longest = 0.2 * min(len(c.q) / c.rate_hz for c in chunks)
    delays = [sign * d for d in _DELAYS_S if d < longest for sign in (1.0, -1.0)]
    if not delays:
        return []
    tried = [(_moved(case, d).error, d) for d in delays]
    error, delay = min(tried)
    if error > bounds.believed_ratio * case.error:
        return []
    text = (
        f"The torque {'lags' if delay > 0 else 'leads'} the motion by about {abs(delay):.2g} s"
        f" (without that, the error falls from {100 * case.error:.3g} to {100 * error:.3g} %)."
    )
    advice = (
        "Stamp position and torque when they are sampled, or set delay_s in the identification"
        " section of the arm's file."
    )
    return [Remark("late_torque", (), text, Grade.DOUBTFUL, advice)]


def _moved(case: Case, delay_s: float) -> Case:
    """The same motion with the torque that came so much later, where the recording holds it."""
    probe = case.probe
    tau = np.zeros_like(probe.tau)
    inside = np.zeros(len(probe.t), dtype=bool)
    for log in np.unique(probe.log):
        own = np.flatnonzero(probe.log == log)
        t = probe.t[own]
        inside[own] = (t + delay_s >= t[0]) & (t + delay_s <= t[-1])
        for k in range(tau.shape[1]):
            tau[own, k] = np.interp(t + delay_s, t, probe.tau[own, k])
    tau = np.where(probe.moving & inside[:, None], tau, 0.0)
    found = replace(case, probe=replace(probe, tau=tau))
    W = case.columns.W * inside[:, None, None]
    found.__dict__["columns"] = replace(case.columns, W=W, tau=tau)
    return found
