"""Long logs by stretches, so that memory and time of a search do not grow with a log's length."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.checks.remark import Grade, Remark, joined
from ident.gap.settings import LongLogs
from ident.recordings.log_summary import summarise_log
from wamctl.arm.recording import LogFile, Piece, Recording, recording_of
from wamctl.arm.ros2.joint_series import Series, rows_of

_NS = 1e9


def stretches(log: LogFile, logs: int, settings: LongLogs) -> list[tuple[str, Recording]]:
    """A log as a whole with its name, or the stretches of a long one, each with a name of its own.

    Args:
        log: the log, which is read in pieces.
        logs: number of logs of the search.
        settings: what is a long log, and how much of it is searched.

    Raises:
        DataError: a log that cannot be used.
    """
    name = str(log.path)
    found = summarise_log(log, name)
    duration, length_s = found.spans_s[-1][1], settings.stretch_s
    if duration <= settings.most_s:
        return [(name, recording_of(found.pieces()))]
    count = max(1, -(-settings.count // logs))
    starts = np.linspace(0.0, duration - length_s, count)
    if count == 1:
        starts = np.array([(duration - length_s) / 2])
    kept: list[list[Piece]] = [[] for _ in starts]
    for piece in found.pieces():
        for parts, start in zip(kept, starts, strict=True):
            first = found.first_ns + round(start * _NS)
            parts.append(_within(piece, first, first + round(length_s * _NS)))
    return [
        (f"{name} ({start:.0f} to {start + length_s:.0f} s)", recording_of(parts))
        for start, parts in zip(starts, kept, strict=True)
        if any(p.states is not None for p in parts)
    ]


def stretch_remarks(
    names: Sequence[str], logs: Sequence[str], settings: LongLogs
) -> tuple[Remark, ...]:
    """What is said of logs of which only stretches are searched; names as `stretches` gives."""
    parts = [name for name in names if name not in logs]
    if not parts:
        return ()
    text = (
        f"Logs of more than {settings.most_s:.0f} s are searched in stretches of"
        f" {settings.stretch_s:.0f} s, here {joined(parts)}: slow changes from one stretch to the"
        " next are not searched for; `ident run` on several logs shows them."
    )
    return (Remark("long_log", (), text, Grade.TRUSTWORTHY),)


def _within(piece: Piece, first_ns: int, end_ns: int) -> Piece:
    """What a piece holds between two instants."""
    return replace(
        piece,
        states=_cut(piece.states, first_ns, end_ns),
        commands=_cut(piece.commands, first_ns, end_ns),
        reference=_cut(piece.reference, first_ns, end_ns),
    )


def _cut(series: Series | None, first_ns: int, end_ns: int) -> Series | None:
    if series is None:
        return None
    inside = (series.stamp_ns >= first_ns) & (series.stamp_ns < end_ns)
    return rows_of(series, inside) if inside.any() else None
