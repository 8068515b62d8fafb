"""Whether the positions are an arm's motion in rad, sampled often enough, and rich enough."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ident.checks.remark import Grade, Remark, joints, numbers
from ident.checks.settings import CheckSettings
from ident.recordings.dataset import Dataset
from ident.regression.probe import Chunk
from ident.signals.arrays import Array
from wamctl.arm.robot import Robot

_DEGREE = np.pi / 180
_ANOTHER_UNIT = (
    "positions or stamps are in another unit, their order is lost, or the URDF's limits are too low"
)
_SOMETIMES = (
    "either two arms publish on one topic, or samples were lost without a gap in the stamps, or an"
    " encoder wraps around"
)
_UNLIMITED = 1e6
"""Velocity limits beyond this [rad/s] are none."""
_AROUND = 2
"""Samples on both sides of a step, after which a glitch is over."""
_FAR = 3.0
"""Of a joint's travel: who passes more is in another unit, or counts turns."""
_MOVES = 0.1
"""Of a joint's standard deviation over a recording, below which it stands still in a part of it."""


def in_degrees(robot: Robot, data: Dataset, bounds: CheckSettings) -> list[NDArray[np.bool_]]:
    """Joints that may be in degrees, shape (n,) each: all, or only some where the others may not.

    No joint is where positions lie within the URDF's limits, or taken for degrees do not, either. A
    joint within its limits that would hardly move in degrees may be in rad. Where most joints would
    hardly move, those that pass far more than their whole travel may be in degrees, or none.
    """
    low, high = _range(robot, data)
    as_degrees = _beyond(robot, low * _DEGREE, high * _DEGREE, bounds)
    moves = (high - low) * _DEGREE > bounds.hardly_moves_rad
    beyond, none = _beyond(robot, low, high, bounds), np.zeros_like(moves)
    if not beyond.any() or as_degrees[beyond].any():
        return [none]
    if 2 * moves.sum() < data.moving.sum():
        travel = np.asarray(robot.model.upperPositionLimit - robot.model.lowerPositionLimit)
        far = beyond & moves & (high - low > _FAR * travel)
        return [far, none] if (far == beyond).all() else [none]
    if as_degrees.any():
        return [none]
    some = beyond | moves | ~data.moving
    return [np.ones_like(some)] if some.all() else [np.ones_like(some), some]


def _range(robot: Robot, data: Dataset) -> tuple[Array, Array]:
    """Lowest and highest position of each joint [rad or m], shape (n,) each."""
    columns = [data.source.joint_names.index(name) for name in robot.joint_names]
    return data.source.low[columns], data.source.high[columns]


def _beyond(robot: Robot, low: Array, high: Array, bounds: CheckSettings) -> NDArray[np.bool_]:
    lower = np.asarray(robot.model.lowerPositionLimit)
    upper = np.asarray(robot.model.upperPositionLimit)
    limited = upper > lower
    slack = bounds.beyond_limits_rad
    return limited & ((low < lower - slack) | (high > upper + slack))


def degrees_remark(data: Dataset, robot: Robot, converted: NDArray[np.bool_]) -> Remark:
    """What is said where positions of these joints, shape (n,), were taken for degrees."""
    low, high = _range(robot, data)
    k = int(np.argmax(np.maximum(np.abs(low), np.abs(high))))
    every = bool(converted.all())
    places = np.flatnonzero(converted)
    whose = "" if every else f" of {joints(places, robot.joint_names)}"
    rest = "" if every else "; the other joints fit the torque in rad"
    text = (
        f"{data.name}: the positions{whose} far exceed the URDF's limits (joint {k + 1}:"
        f" {low[k]:.4g} to {high[k]:.4g}), but keep them if they are in degrees, so they were"
        f" converted to rad{rest}."
    )
    named = () if every else numbers(places)
    return Remark("degrees", named, text, Grade.DOUBTFUL, "Record positions in rad.")


def limit_remarks(robot: Robot, data: Dataset, bounds: CheckSettings) -> list[Remark]:
    """Joints that went where the URDF says that they cannot, by no common factor."""
    low, high = _range(robot, data)
    places = np.flatnonzero(_beyond(robot, low, high, bounds))
    if not len(places):
        return []
    k = int(places[0])
    lower, upper = robot.model.lowerPositionLimit[k], robot.model.upperPositionLimit[k]
    text = (
        f"{data.name}: {joints(places, robot.joint_names)} exceeded the URDF's limits (joint"
        f" {k + 1}: {low[k]:.4g} to {high[k]:.4g}, allowed {lower:.4g} to {upper:.4g})."
    )
    advice = "Check the unit, the zero position, and whether the encoder counts whole turns."
    return [Remark("beyond_limits", numbers(places), text, Grade.DOUBTFUL, advice)]


def jump_remarks(
    robot: Robot, data: Sequence[Dataset], chunks: Sequence[Chunk], bounds: CheckSettings
) -> list[Remark]:
    """Steps from sample to sample that no joint can make."""
    speed = np.asarray(robot.model.velocityLimit)
    limited = (speed > 0) & (speed < _UNLIMITED)
    most = np.full_like(speed, np.inf)
    most[limited] = bounds.jump_speeds * speed[limited]
    found = []
    for log, one in enumerate(data):
        own = [c for c in chunks if c.log == log]
        rate = np.concatenate([np.abs(np.diff(c.q, axis=0)) * c.rate_hz for c in own])
        wild = rate > most
        share = float(wild.any(axis=1).mean())
        if _in_turn([c.q[:, one.moving] for c in own], bounds):
            text = (
                f"{one.name}: the positions alternate between two motions from sample to sample:"
                " two arms publish on one topic."
            )
            advice = "Record only one of them, or give their joints different names."
            found.append(Remark("jumps", (), text, Grade.REFUSED, advice))
        elif share > bounds.jump_share:
            places = np.flatnonzero(wild.any(axis=0))
            always = share > bounds.jump_share_always
            why = _ANOTHER_UNIT if always else _SOMETIMES
            fastest = np.where(wild, rate, 0.0).max(axis=0)
            k = int(fastest.argmax())
            text = (
                f"{one.name}: {joints(places, robot.joint_names)} jumped {int(wild.sum())} times"
                f" between consecutive samples, at up to {fastest[k]:.3g} rad/s, where the URDF's"
                f" limit is {speed[k]:.3g}: {why}."
            )
            grade = Grade.REFUSED if share > bounds.jump_share_refused else Grade.DOUBTFUL
            advice = (
                "Give positions in rad and stamps in s, in the order in which they were recorded."
                if always
                else "Record one arm only, with continuous angles."
            )
            found.append(Remark("jumps", numbers(places), text, grade, advice))
        elif (cut := np.any([_cut(c.q, most / c.rate_hz) for c in own], axis=0)).any():
            fastest = np.where(wild, rate, 0.0).max(axis=0)
            found.append(_missing(one, robot, np.flatnonzero(cut), fastest))
    return found


def _missing(one: Dataset, robot: Robot, places: NDArray[np.int64], fastest: Array) -> Remark:
    k = int(places[fastest[places].argmax()])
    text = (
        f"{one.name}: {joints(places, robot.joint_names)} jumped together from one sample to the"
        f" next, and stayed there (joint {k + 1} at {fastest[k]:.3g} rad/s, where the URDF's limit"
        f" is {robot.model.velocityLimit[k]:.3g}): motion is missing, without a gap in the stamps."
    )
    advice = "Give the true stamps, or each piece as a log of its own."
    return Remark("jumps", numbers(places), text, Grade.DOUBTFUL, advice)


def _cut(q: Array, most: Array) -> NDArray[np.bool_]:
    """Joints that jump at once with another one, farther than they can, and do not come back.

    Args:
        q: positions, shape (S, n).
        most: farthest step of each joint, shape (n,).

    Returns:
        shape (n,); joints that jump alone count as single glitches.
    """
    around, end = _AROUND, len(q) - _AROUND
    step = np.diff(q, axis=0)[around : end - 1]
    kept = q[2 * around + 1 :] - q[: -2 * around - 1]
    wild = (np.abs(step) > most) & (kept * np.sign(step) > 0.5 * np.abs(step))
    return np.any(wild[wild.sum(axis=1) > 1], axis=0)


def _in_turn(positions: Sequence[Array], bounds: CheckSettings) -> bool:
    """Whether every other sample is smooth, and all of them together are not."""
    if min(len(q) for q in positions) < bounds.alternating_samples:
        return False
    together = max(_interpolation(q) for q in positions)
    apart = max(_interpolation(part) for q in positions for part in (q[::2], q[1::2]))
    smooth = apart < bounds.interpolation_doubtful
    return smooth and together > max(
        bounds.interpolation_doubtful, bounds.alternating_ratio * apart
    )


def rate_remarks(
    data: Sequence[Dataset], chunks: Sequence[Chunk], bounds: CheckSettings
) -> list[Remark]:
    """Recordings whose samples lie too far apart for their motion.

    A joint that hardly moves says nothing of the rate, but of its encoder's noise.
    """
    found = []
    for log, one in enumerate(data):
        own = [c.q for c in chunks if c.log == log]
        moves = one.moving & (np.ptp(np.concatenate(own), axis=0) >= bounds.hardly_moves_rad)
        courses = [q[:, moves] for q in own] if moves.any() else []
        if not courses:
            continue
        least = _MOVES * np.concatenate(courses).std(axis=0)
        worst = max(_interpolation(q, least) for q in courses)
        if worst < bounds.interpolation_doubtful:
            continue
        grade = Grade.REFUSED if worst > bounds.interpolation_refused else Grade.DOUBTFUL
        text = (
            f"{one.name}: a sampling rate of {one.rate_hz:.4g} Hz is too low for this motion (every"
            f" second sample, interpolated from its neighbours, is off by {100 * worst:.3g} % of"
            " the joint's standard deviation)."
        )
        advice = "Record at a higher rate, or move more slowly."
        found.append(Remark("low_rate", (), text, grade, advice))
    return found


def _interpolation(q: Array, least: Array | float = 1e-12) -> float:
    """Error of the odd samples, predicted by the cubic through the even ones beside them.

    The joint's standard deviation is one; the worst joint counts.

    Args:
        q: positions, shape (N, n).
        least: standard deviation that a joint is taken to have at least, shape (n,): of one that
            stands still, the noise says nothing of the rate.
    """
    if len(q) < 16:
        return 0.0
    even, odd = q[::2], q[1::2]
    count = min(len(even) - 3, len(odd) - 2)
    inner = even[1 : count + 1], even[2 : count + 2]
    outer = even[:count], even[3 : count + 3]
    guess = (9 * (inner[0] + inner[1]) - (outer[0] + outer[1])) / 16
    error = np.sqrt(np.mean((odd[1 : count + 1] - guess) ** 2, axis=0))
    return float(np.max(error / np.maximum(np.maximum(q.std(axis=0), least), 1e-12)))


def little_motion(
    robot: Robot, data: Sequence[Dataset], chunks: Sequence[Chunk], bounds: CheckSettings
) -> list[Remark]:
    """Joints that move, but hardly."""
    moving = np.any([d.moving for d in data], axis=0)
    span = np.max([np.ptp(c.q, axis=0) for c in chunks], axis=0)
    speed = np.max([_speed(c) for c in chunks], axis=0)
    little = span < bounds.hardly_moves_rad
    slow = speed < bounds.hardly_moves_rad_s
    places = np.flatnonzero(moving & (little | slow))
    if not len(places):
        return []
    k = int(places[0])
    one = len(places) == 1
    text = (
        f"J{joints(places, robot.joint_names)[1:]} hardly {'moves' if one else 'move'} (joint"
        f" {k + 1}: {span[k]:.2g} rad, at most {speed[k]:.2g} rad/s), so that friction masks the"
        " other parameters."
    )
    they, them = ("it", "it") if one else ("they", "them")
    advice = f"Move {them} farther and faster, or hold {them} still."
    everywhere = len(places) == int(moving.sum())
    if everywhere and not little[moving].any():
        advice = f"{advice[:-1]}; if {they} did move faster, correct the unit of the stamps."
    grade = Grade.REFUSED if everywhere else Grade.DOUBTFUL
    return [Remark("poor_motion", numbers(places), text, grade, advice)]


def _speed(chunk: Chunk) -> Array:
    """The speed that is exceeded during 2 % of the time, over a tenth of a second [rad/s]."""
    reach = max(1, round(0.1 * chunk.rate_hz))
    if len(chunk.q) <= reach:
        return np.zeros(chunk.q.shape[1])
    return np.quantile(np.abs(chunk.q[reach:] - chunk.q[:-reach]), 0.98, axis=0) * (
        chunk.rate_hz / reach
    )
