"""How well the answers of a plan predicted a round's logs."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from wamctl.arm.arrays import Array
from wamctl.arm.errors import DataError

_LEAST = 1e-300  # of a sum of squares that is divided by


def compared(weights: Path, leader: str) -> tuple[dict[str, list[float]], dict[str, float]]:
    """Log-likelihood of the leader less that of each rival in a round's blocks, by rival [nats].

    And the share of each rival's squared error that the leader does not make.

    Raises:
        DataError: what `ident weigh` wrote cannot be read.
    """
    logs = read(weights)["logs"]
    nats = {
        n: np.concatenate([log["log_likelihood"][n] for log in logs])
        for n in logs[0]["log_likelihood"]
    }
    squares = {n: np.sum([log["squares"][n] for log in logs], axis=0) for n in nats}
    bets, closed = {}, {}
    for rival in [name for name in nats if name != leader]:
        bets[rival] = (nats[leader] - nats[rival]).sum(axis=1).tolist()
        closed[rival] = share_closed(squares[leader], squares[rival])
    return bets, closed


def share_closed(squares: Array, rival: Array) -> float:
    """Share of a rival's squared error that another answer does not make.

    At the joint at which they differ most; both of shape (n,).
    """
    gained = rival - squares
    joint = int(np.abs(gained).argmax())
    return float(gained[joint] / max(rival[joint], _LEAST))


def closed_by(weights: Path, answer: str, rival: str) -> float | None:
    """The same of two answers in a file of `ident weigh`; None where it has not both."""
    logs = [log["squares"] for log in read(weights)["logs"]] if weights.exists() else []
    if not logs or not {answer, rival} <= set(logs[0]):
        return None
    own, other = (np.sum([s[name] for s in logs], axis=0) for name in (answer, rival))
    return share_closed(own, other)


def read(path: Path) -> dict[str, Any]:
    """A result file.

    Raises:
        DataError: it cannot be read.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise DataError(f"{path} cannot be read ({error}).") from error
