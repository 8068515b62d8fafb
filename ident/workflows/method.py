"""Which method a log allows: regression on torque, or simulation of commanded positions."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ident.checks.remark import Grade, Remark
from ident.recordings.loading import Reading, commanded_joints
from wamctl.arm.recording import LogFile

_COARSE_LEVELS = 64
"""A torque of fewer different values than this is counted, not measured."""

_WRAPPED = (
    "its values lie near nothing and near the largest, as negative ones do that were read without"
    " their sign, 65535 for -1: take 65536 steps from the upper ones in the table, and import it"
    " again"
)

_MANY = 8

_NO_TORQUE = (
    "The recordings hold no joint torque, so servos, friction, and gears are identified by"
    " simulating the commanded positions (--method simulation)."
)
_NO_USE = (
    "The effort in the recordings cannot be fitted as a torque ({why}), so it was ignored: servos,"
    " friction, and gears are identified by simulating the commanded positions"
    " (--method simulation; --method regression uses the effort as it is)."
)


def method_for(
    paths: Sequence[Path], robot: Path | None, reading: Reading
) -> tuple[str, list[Remark]]:
    """The method, and a remark where it is not regression.

    Args:
        paths: the logs.
        robot: file that describes the arm, which tells its joints where a log holds others too.
        reading: topics to read; a torque that is asked for is used.

    Raises:
        DataError: a log that cannot be read.
        ConfigurationError: a robot file that cannot be used.
    """
    if reading.torque is not None:
        return "regression", []
    reasons = [_without_torque(path, robot, reading) for path in paths]
    if any(reason is None for reason in reasons):
        return "regression", []
    why = next((r for r in reasons if r), "")
    sentence = _NO_USE.format(why=why) if why else _NO_TORQUE
    return "simulation", [Remark("no_torque", (), sentence, Grade.TRUSTWORTHY)]


def _without_torque(path: Path, robot: Path | None, reading: Reading) -> str | None:
    """Why a log's effort is of no use; empty where it has none; None where it is of use.

    A log without commanded positions is left to the other method in any case. Reading ends where
    the effort has shown both signs and many values.
    """
    topics = reading.joint_states, reading.joint_commands
    log = LogFile(path, *topics, *commanded_joints(path, robot, reading), torque=False)
    commanded = signed = False
    levels: list[set[float]] = []
    for piece in log.pieces():
        if piece.commands is not None:
            if piece.commands.effort is not None:
                return None
            commanded = commanded or piece.commands.q is not None
        if piece.states is not None and (effort := piece.states.effort) is not None:
            levels = levels or [set() for _ in effort.T]
            for seen, column in zip(levels, effort.T, strict=True):
                seen.update(np.unique(column).tolist())
            signed = signed or bool(effort.min() < 0.0 or not effort.any())
            if signed and max(map(len, levels)) >= _COARSE_LEVELS:
                return None
    if not commanded:
        return None
    if not levels:
        return ""
    if not signed:
        return _WRAPPED if any(map(_is_wrapped, levels)) else "it has no sign"
    return f"it has only {max(map(len, levels))} different values"


def _is_wrapped(values: set[float]) -> bool:
    """Whether many values lie at either end of their range, and none in the middle half of it."""
    told = np.sort(list(values))
    k = int(np.diff(told).argmax()) + 1 if len(told) > 1 else 0
    both = min(k, len(told) - k) >= _MANY
    return both and bool(told[k] - told[k - 1] > 0.5 * told[-1])
