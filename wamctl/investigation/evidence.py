"""Evidence that stays valid although it is looked at after every motion.

Two answers have written down what they predict of a motion. In each block of time the one with the
smaller squared residual wins; its share of the sum is a bet's outcome between -1 and 1. If the
rival predicts at least as well on average (residuals symmetric about it and unimodal, of whatever
size), a wealth that bets a fixed share on the leader is a supermartingale, so that by Ville's
inequality it ever exceeds 1/alpha with a probability of at most alpha (Ramdas, Grunwald, Vovk,
Shafer 2023, "Game-theoretic statistics and safe anytime-valid inference", sections 2 and 3). The
mean over several shares is one again.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from wamctl.arm.arrays import Array

_MOST_ODDS = 1e6
_WORDS = {
    "none": "no effect",
    "unknown": "an effect without a name",
    "no_gap": "no gap",
    "measured_effect": "a measured curve",
}
SHARES = (0.1, 0.25, 0.5, 0.75, 0.9)
"""Of the wealth, that are bet on each block."""

SEARCH_NATS = 3.0
"""What a search counts for the answer that it gives to the data it searches: twenty to one."""


def outcomes(leader: Array, rival: Array, weights: Array) -> Array:
    """Outcome of the bet on the leader in each block, -1 to 1, shape (B,).

    Args:
        leader: its squared residuals, shape (B, n).
        rival: those of the rival, shape (B, n).
        weights: of the joints, fixed before the motion, shape (n,).
    """
    lost, won = leader @ weights, rival @ weights
    total = lost + won
    return np.divide(won - lost, total, out=np.zeros_like(total), where=total > 0.0)


def log_evidence(bets: Sequence[float]) -> float:
    """Logarithm of the e-value of the leader over a rival after these outcomes [nats]."""
    wealth = [float(np.log1p(share * np.array(bets, dtype=float)).sum()) for share in SHARES]
    most = max(wealth)
    return most + math.log(sum(math.exp(w - most) for w in wealth) / len(wealth))


def odds_text(nats: float) -> str:
    """Evidence as odds: `200 to 1`, or `1 to 3` where it speaks against."""
    if abs(nats) > math.log(_MOST_ODDS):
        large = f"more than {_MOST_ODDS:,.0f}"
        return f"{large} to 1" if nats > 0.0 else f"1 to {large}"
    size = f"{math.exp(abs(nats)):,.{0 if abs(nats) > math.log(10.0) else 1}f}"
    return f"{size} to 1" if nats >= 0.0 else f"1 to {size}"


def words(answer: str) -> str:
    """An answer or a verdict as the operator reads it: `stribeck:4` is `stribeck at joint 4`."""
    name, _, joints = answer.partition(":")
    said = _WORDS.get(name, name.replace("_", " "))
    return f"{said} at joint {joints.replace(',', ', ')}" if joints else said


def signed_evidence(bets: Sequence[float]) -> float:
    """Evidence of the leader over a rival [nats], or minus that of the rival over it."""
    ahead = log_evidence(bets)
    return ahead if ahead > 0.0 else -max(log_evidence([-b for b in bets]), 0.0)


def asked(alpha: float, leaders: int) -> float:
    """What confirms the answer that leads as the k-th one [nats]: alpha / 2^k is spent on it.

    Args:
        alpha: error rate of the whole investigation.
        leaders: how many different answers have led, this one included.
    """
    return math.log(2.0**leaders / alpha)


def odds(
    searched: Mapping[str, float], pairs: Mapping[tuple[str, str], Sequence[float]]
) -> dict[str, float]:
    """How much each answer is believed; they add to one.

    Args:
        searched: answers, and what searches of the same data count for each [nats].
        pairs: outcomes of all bets, by leader and rival.
    """
    nats = dict(searched)
    for leader, rival in pairs:
        nats.setdefault(leader, 0.0)
        nats.setdefault(rival, 0.0)
    for (_, rival), bets in pairs.items():
        nats[rival] -= signed_evidence(bets)
    most = max(nats.values())
    parts = {name: math.exp(value - most) for name, value in nats.items()}
    whole = sum(parts.values())
    return {name: part / whole for name, part in parts.items()}
