"""The state of a bristle: friction that depends on the distance since the last reversal."""

import numpy as np

from ident.signals.arrays import Array


def stretch(q: Array, distance: float, slips: bool) -> Array:
    """State of a bristle that follows q [rad], shape (S,), in parts of its breaking stretch.

    Between two reversals it is known in closed form; only from reversal to reversal is one step
    taken after the other.

    Args:
        q: joint position, shape (S,).
        distance: over which it stretches [rad].
        slips: True: linear, then slips (Maxwell); False: ever slower (Dahl, LuGre).
    """
    if len(q) < 2:
        return np.zeros(len(q))
    ahead = np.where(np.diff(q) >= 0.0, 1.0, -1.0)
    turns = np.concatenate([[0], 1 + np.flatnonzero(np.diff(ahead)), [len(q) - 1]])
    way, signs = np.diff(q[turns]) / distance, ahead[turns[:-1]]
    known = [0.0]
    if slips:
        state = 0.0
        for dx in way.tolist():
            state += dx
            state = 1.0 if state > 1.0 else -1.0 if state < -1.0 else state
            known.append(state)
    else:
        for left, sign in zip(np.exp(-np.abs(way)).tolist(), signs.tolist(), strict=True):
            known.append(sign * (1.0 - (1.0 - sign * known[-1]) * left))
    lengths = np.diff(turns)
    start, sign = np.repeat(known[:-1], lengths), np.repeat(signs, lengths)
    since = (q[1:] - np.repeat(q[turns[:-1]], lengths)) / distance
    if slips:
        later = np.clip(start + since, -1.0, 1.0)
    else:
        later = sign * (1.0 - (1.0 - sign * start) * np.exp(-np.abs(since)))
    return np.concatenate([[0.0], later])
