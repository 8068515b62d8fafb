"""Evidence that stays valid although it is looked at after every motion.

Two answers have written down what they predict of a motion, and with which noise. Each block of
time multiplies a wealth by twice the leader's share of their two likelihoods, 2 / (1 + exp(-z)) for
a log-likelihood ratio z. Should the rival predict at least as well (z symmetric about something not
above zero, of whatever size), the factor's mean is at most one, so that by Ville's inequality the
wealth ever exceeds 1/alpha with a probability of at most alpha (Ramdas, Grunwald, Vovk, Shafer
2023, "Game-theoretic statistics and safe anytime-valid inference", sections 2 and 3). The same
holds for z over any factor, by which the noise may be larger than written down, and for the mean
over several. It holds for wealth that waits for a later motion, too: half of what is left is bet
from each motion on, so that what a model predicted badly, when it was fitted to one log, does not
outweigh for ever what it predicts well after several.
"""

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from wamctl.arm.arrays import Array
from wamctl.arm.joint_labels import joints_text, listed

_MOST_ODDS = 1e6
_WORDS = {
    "none": "no effect",
    "unknown": "an effect without a name",
    "no_gap": "no gap",
    "measured_effect": "a measured curve",
}
NOISIER = (1.0, 4.0, 16.0, 64.0, 256.0, 1024.0)
"""So many times the variance that was written down; rows that are alike count in it."""

ALPHA = 0.01
"""Probability with which an investigation may confirm a wrong name, over all its rounds."""

SEARCH_NATS = 3.0
"""What a search counts for the answer that it gives to the data it searches: twenty to one."""


def growth(ratios: Array) -> Array:
    """Growth of the log of the wealth in each block, by factor on the noise, shape (F, B) [nats].

    Args:
        ratios: log-likelihood of the leader less that of the rival, shape (B,) [nats].
    """
    return math.log(2.0) - np.logaddexp(0.0, -ratios / np.array(NOISIER)[:, None])


def log_evidence(motions: Sequence[Sequence[float]]) -> float:
    """Logarithm of the e-value of the leader over a rival after these motions [nats].

    Args:
        motions: of each motion, log-likelihood of the leader less that of the rival, by block
            [nats].
    """
    if not motions:
        return 0.0
    grown = np.array([growth(np.array(m, dtype=float)).sum(axis=1) for m in motions])
    wealth = np.cumsum(grown[::-1], axis=0)[::-1]  # of what is bet from each motion on
    bet = -math.log(2.0) * np.arange(1, len(motions) + 1)
    parts = wealth + bet[:, None] - math.log(len(NOISIER))
    kept = -math.log(2.0) * len(motions)
    return float(np.logaddexp.reduce(np.append(parts, kept)))


def odds_text(nats: float) -> str:
    """Evidence as odds: `200 to 1`, or `1 to 3` where it speaks against."""
    if abs(nats) > math.log(_MOST_ODDS):
        large = f"more than {_MOST_ODDS:,.0f}"
        return f"{large} to 1" if nats > 0.0 else f"1 to {large}"
    size = f"{math.exp(abs(nats)):,.{0 if abs(nats) > math.log(10.0) else 1}f}"
    return f"{size} to 1" if nats >= 0.0 else f"1 to {size}"


def words(answer: str) -> str:
    """An answer or a verdict as the operator reads it: `stribeck:4` is `stribeck at joint 4`."""
    return listed([_effect_words(*part.partition(":")[::2]) for part in answer.split("+")])


def _effect_words(name: str, joints: str) -> str:
    said = _WORDS.get(name, name.replace("_", " "))
    return f"{said} at {joints_text(joints.split('-'))}" if joints else said


def signed_evidence(motions: Sequence[Sequence[float]]) -> float:
    """Evidence of the leader over a rival [nats], or minus that of the rival over it."""
    ahead, behind = log_evidence(motions), log_evidence([[-z for z in m] for m in motions])
    return ahead if ahead > 0.0 else -max(behind, 0.0)


def asked(alpha: float, leaders: int, among: int = 1) -> float:
    """What confirms the answer that leads as the k-th one [nats]: alpha / 2^k is spent on it.

    Args:
        alpha: error rate of the whole investigation.
        leaders: how many different answers have led, this one included.
        among: of how many answers it was chosen by motions that count for it.
    """
    return math.log(2.0**leaders * among / alpha)


def odds(
    searched: Mapping[str, float],
    pairs: Mapping[tuple[str, str], Sequence[Sequence[float]]],
    alike: Collection[str] = (),
) -> dict[str, float]:
    """How much each answer is believed; they add to one.

    What a search of the same motions does not see counts at most as much as that search: answers
    that are wrong alike predict at different odds. Between answers that it cannot tell apart no
    prediction counts.

    Args:
        searched: answers that a search of the same motions sees, and what that counts for each
            [nats].
        pairs: log-likelihood ratios of all blocks of each motion, by leader and rival [nats].
        alike: answers that the search cannot tell apart.
    """
    nats = dict(searched)
    for leader, rival in pairs:
        nats.setdefault(leader, 0.0)
        nats.setdefault(rival, 0.0)
    for (leader, rival), motions in pairs.items():
        if leader in alike and rival in alike:
            continue
        ahead = signed_evidence(motions)
        seen = (leader if ahead > 0.0 else rival) in searched
        nats[rival] -= ahead if seen else max(-SEARCH_NATS, min(ahead, SEARCH_NATS))
    most = max(nats.values())
    parts = {name: math.exp(value - most) for name, value in nats.items()}
    whole = sum(parts.values())
    return {name: part / whole for name, part in parts.items()}
