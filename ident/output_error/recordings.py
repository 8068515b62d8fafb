"""Recordings as segments of commands and positions."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ident.output_error.glitches import unreachable
from ident.output_error.plant.servo import Motion
from ident.output_error.setup import MotionSegment
from ident.recordings.errors import JointMismatchError
from ident.recordings.log_summary import GAP_PERIODS
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError
from wamctl.arm.recording import Recording

_SHORTEST = 20
"""A segment has so many samples at least."""

_ENOUGH_HZ = 100.0  # twice what gears and links move at; more samples take longer and tell no more
_PARTS = 3
_PIECE_S = 8.0
SEARCHED_S = 150.0
"""More than this tells a search nothing new."""

GLANCED_S = 60.0
"""Enough for a servo's own parts, which move the arm most."""

_STILL = 1e-9
"""Rms speed below which a joint is at rest [rad/s]."""

WARM_S = 0.5
"""What a simulation that begins in the middle of a motion needs to find its way [s]."""


def segments_of(
    recording: Recording, joint_names: Sequence[str], name: str
) -> tuple[MotionSegment, ...]:
    """Commands and positions of a recording between its holes, joints in the robot's order.

    Positions before the first command are left out: nobody knows what they followed. So are those
    that no motion can reach, which are counted with the first segment. Of faster recordings about a
    hundred positions a second are taken; commands are all kept.

    Raises:
        DataError: a loop that is no servo, no commanded positions, other joints, or too few
            samples.
    """
    _check_is_of_servos(recording, name)
    missing = [j for j in joint_names if j not in recording.joint_names]
    if missing:
        raise JointMismatchError(name, missing, recording.joint_names)
    columns = [recording.joint_names.index(j) for j in joint_names]
    stamp_ns, wanted = _commands(recording, name)
    new = np.diff(recording.stamp_ns, prepend=recording.stamp_ns[0] - 1) > 0
    new &= recording.stamp_ns >= stamp_ns[0]
    _check_follows(int(new.sum()), stamp_ns[0] - recording.stamp_ns[0], name)
    zero = recording.stamp_ns[0]
    t, q = (recording.stamp_ns[new] - zero) * 1e-9, recording.q[new][:, columns]
    q = np.unwrap(q, axis=0)  # an encoder of one turn
    wrong = unreachable(t, q)
    t, q = t[~wrong.any(axis=1)], q[~wrong.any(axis=1)]
    every = max(int((len(t) - 1) / max(t[-1] - t[0], 1e-9) / _ENOUGH_HZ), 1)
    t, q = t[::every], q[::every]
    fresh = np.diff(stamp_ns, prepend=stamp_ns[0] - 1) > 0
    stamp, command = (stamp_ns[fresh] - zero) * 1e-9, wanted[fresh][:, columns]
    period = float(np.median(np.diff(t)))
    edges = [0, *(np.flatnonzero(np.diff(t) > GAP_PERIODS * period) + 1), len(t)]
    parts = [slice(a, b) for a, b in itertools.pairwise(edges) if b - a >= _SHORTEST]
    if not parts:
        raise DataError(f"{name} has {len(t)} samples; a simulation needs {_SHORTEST} in a row.")
    first, *others = (
        _segment(t[p], q[p], stamp, command, name, warm=i > 0) for i, p in enumerate(parts)
    )
    return replace(first, wrong=tuple(wrong.sum(axis=0).tolist())), *others


def thinned(
    segments: Sequence[MotionSegment], seconds: float = SEARCHED_S
) -> tuple[MotionSegment, ...]:
    """What a search looks at: all of it, or pieces spread over recordings that last long.

    Of pieces that follow each other it takes the one that moves most: what limits a servo shows
    where most is asked of it, which may be the last seconds of a chirp.

    Args:
        segments: the recordings.
        seconds: length beyond which pieces are taken.

    Raises:
        DataError: fewer than three, since the recordings are too short or sampled too slowly.
    """
    cut = _cut(segments, 1)
    if len(cut) < _PARTS:
        cut = _cut(segments, _PARTS)
    if len(cut) < _PARTS:
        longest = max(_seconds(s) for s in segments)
        period = np.median(np.concatenate([np.diff(s.motion.t) for s in segments]))
        raise DataError(
            f"{segments[0].name}: unbroken motion of {longest:.3g} s with a sample every"
            f" {period:.3g} s does not give {_PARTS} pieces of at least {_SHORTEST} samples and"
            f" {2 * WARM_S:g} s, each to be predicted from the others; record longer or at a higher"
            " rate, and check that times are in seconds."
        )
    every = math.ceil(sum(_seconds(s) for s in segments) / seconds)
    return tuple(segments) if every == 1 else _fastest(cut, every)


def _cut(segments: Sequence[MotionSegment], least: int) -> list[MotionSegment]:
    """All recordings in pieces of about one length, each recording in so many at least."""
    return [
        piece for s in segments for piece in pieces([s], max(round(_seconds(s) / _PIECE_S), least))
    ]


def _fastest(cut: Sequence[MotionSegment], every: int) -> tuple[MotionSegment, ...]:
    """Of each so many pieces the one whose joints move most, each by its own usual speed."""
    speeds = np.array([_speeds(s) for s in cut])
    usual = np.maximum(np.sqrt(np.mean(speeds**2, axis=0)), _STILL)
    moves = (speeds / usual).mean(axis=1)
    starts = range(0, len(cut), every)
    return tuple(cut[i + int(np.argmax(moves[i : i + every]))] for i in starts)


def _speeds(segment: MotionSegment) -> Array:
    """Rms of the measured speed [rad/s], shape (n,)."""
    speed = np.diff(segment.q, axis=0) / np.diff(segment.motion.t)[:, None]
    return np.sqrt(np.mean(speed**2, axis=0))


def _seconds(segment: MotionSegment) -> float:
    return float(segment.motion.t[-1] - segment.motion.t[0])


def pieces(segments: Sequence[MotionSegment], count: int) -> tuple[MotionSegment, ...]:
    """Each segment cut into parts of one length; those too short to be simulated are left out."""
    cut = []
    for s in segments:
        bounds = np.linspace(0, len(s.q), count + 1).astype(int)
        for k, (a, b) in enumerate(itertools.pairwise(bounds)):
            m = s.motion
            if b - a >= _SHORTEST and m.t[b - 1] - m.t[a] >= 2 * WARM_S:
                part = _segment(m.t[a:b], s.q[a:b], m.stamp, m.command, s.name, warm=k > 0)
                cut.append(replace(part, counted=max(part.counted, s.counted - a)))
    return tuple(cut)


def settled(segments: Sequence[MotionSegment]) -> tuple[MotionSegment, ...]:
    """The same, but that errors of the first moments do not count: nobody knows how they began."""
    counts = (int(np.searchsorted(s.motion.t, s.motion.t[0] + WARM_S)) for s in segments)
    return tuple(
        replace(s, counted=max(s.counted, count)) for s, count in zip(segments, counts, strict=True)
    )


def _check_is_of_servos(recording: Recording, name: str) -> None:
    """Refuse a log of `wamctl`'s own loop: no position servo, and its torque is in the log."""
    if b"\ncontroller:" in recording.attachments.get("config.yaml", b""):
        raise DataError(
            f"{name} was recorded by wamctl, which commands torque (computed torque and PD);"
            " identification by simulation fits position servos. Use regression, the usual method:"
            " the log holds the torque."
        )


def _check_follows(count: int, late_ns: int, name: str) -> None:
    """Refuse a recording of which too few positions follow the first command."""
    if count < _SHORTEST:
        raise DataError(
            f"{name}: its first command is stamped {late_ns * 1e-9:.4g} s after its first position,"
            f" and only {count} positions follow; stamp both by the same clock."
        )


def _commands(recording: Recording, name: str) -> tuple[NDArray[np.int64], Array]:
    command, reference = recording.command, recording.reference
    if command is not None and command.q is not None:
        return command.stamp_ns, command.q
    if reference is not None and reference.q.shape[1] == recording.q.shape[1]:
        return reference.stamp_ns, reference.q
    raise DataError(
        f"{name} holds no commanded positions: /joint_commands has no position, and there is no"
        " /joint_reference; name the topic of what the arm was asked for (--joint-commands), or"
        " record it beside what the arm did."
    )


def _segment(
    t: Array, q: Array, stamp: Array, command: Array, name: str, *, warm: bool
) -> MotionSegment:
    first = max(int(np.searchsorted(stamp, t[0], side="right")) - 30, 0)
    last = int(np.searchsorted(stamp, t[-1], side="right")) + 1
    speed = (q[2] - q[0]) / (t[2] - t[0])
    motion = Motion(
        np.ascontiguousarray(t),
        np.ascontiguousarray(stamp[first:last]),
        np.ascontiguousarray(command[first:last]),
        q[0].copy(),
        speed,
    )
    counted = int(np.searchsorted(t, t[0] + WARM_S)) if warm else 0
    return MotionSegment(motion, np.ascontiguousarray(q), name, counted)
