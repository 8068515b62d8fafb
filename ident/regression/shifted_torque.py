"""A probe's torque as of other instants: what it would be, had it been stamped later or earlier."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ident.recordings.samples import resampled
from ident.regression.probe import Chunk, Probe, filtered_torque
from ident.signals.arrays import Array


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
