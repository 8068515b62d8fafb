"""JointTrajectory messages as the positions that a controller asks for from instant to instant.

A message replaces what is left of the one before. Between points a controller interpolates: by
cubics where both points have velocities, else by straight lines (`joint_trajectory_controller`'s
documentation, "Trajectory Representation"). A trajectory begins where the one before has come and
as fast, or at rest where the joints are; joints that it leaves out stay there.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from wamctl.arm.arrays import Array
from wamctl.arm.errors import DataError
from wamctl.arm.ros2.joint_messages import decoded
from wamctl.arm.ros2.joint_series import JointSeries

TRAJECTORY_TYPE = "trajectory_msgs/msg/JointTrajectory"

_PERIOD_NS = 10_000_000
_LONGEST_NS = 3_600_000_000_000
_NS = 1_000_000_000

Measured = Callable[[tuple[str, ...], int], Array | None]
"""Positions of some joints at an instant [ns]; None: not known."""


class _Point(NamedTuple):
    ns: int
    q: Array
    qd: Array | None


@dataclass(frozen=True)
class _Samples:
    ns: list[int]
    q: list[Array]


class CommandedMotion:
    """What one topic's messages ask for, followed from message to message.

    Args:
        where: what to call the topic in messages.
    """

    def __init__(self, where: str) -> None:
        self._where = where
        self._plans: dict[tuple[str, ...], list[_Point]] = {}

    def taken(
        self, messages: Sequence[bytes], log_ns: Sequence[int], measured: Measured
    ) -> list[JointSeries]:
        """Positions up to the last message's beginning, every 10 ms and at each point.

        Args:
            messages: CDR.
            log_ns: instants of recording [ns], which stand in for headers without a stamp.
            measured: where the joints were.

        Raises:
            DataError: a message that is no JointTrajectory, or points that cannot be followed.
        """
        made: dict[tuple[str, ...], _Samples] = {}
        for data, logged in zip(messages, log_ns, strict=True):
            message = decoded(data, TRAJECTORY_TYPE)
            header = message.header.stamp
            start = header.sec * _NS + header.nanosec or logged
            names = tuple(message.joint_names)
            points = self._points(message, names, start)
            known = next((k for k in self._plans if set(k) & set(names)), names)
            plan = self._plans.pop(known, [])
            _follow(plan, start, made.setdefault(known, _Samples([], [])))
            whole = known + tuple(n for n in names if n not in known)
            wanted = dict(zip(names, points[0].q, strict=True)) if points else {}
            begun = _first_of_all(_begun(plan, start), whole, start, measured, wanted)
            self._plans[whole] = [*begun, *(_of_all(p, names, whole, begun) for p in points)]
        return [_series(names, samples) for names, samples in made.items() if samples.ns]

    def rest(self) -> list[JointSeries]:
        """What the last messages still ask for."""
        ended = []
        for names, plan in self._plans.items():
            samples = _Samples([], [])
            _follow(plan, plan[-1].ns + 1 if plan else 0, samples)
            ended += [_series(names, samples)] if samples.ns else []
        self._plans.clear()
        return ended

    def _points(self, message: Any, names: tuple[str, ...], start: int) -> list[_Point]:
        points, last = [], start - 1
        for point in message.points:
            after = point.time_from_start.sec * _NS + point.time_from_start.nanosec
            q, qd = np.asarray(point.positions), np.asarray(point.velocities)
            if len(q) != len(names) or len(qd) not in (0, len(names)):
                raise DataError(
                    f"{self._where}: the JointTrajectory at {start} ns has {len(names)} names and"
                    f" a point of {len(q)} positions and {len(qd)} velocities."
                )
            if start + after <= last or after > _LONGEST_NS:
                raise DataError(
                    f"{self._where}: the JointTrajectory at {start} ns has a point {after * 1e-9:g}"
                    f" s from its start: points have to follow each other, within"
                    f" {_LONGEST_NS // _NS} s."
                )
            last = start + after
            points.append(_Point(last, q, qd if len(qd) else None))
        return points


def _follow(plan: list[_Point], until: int, samples: _Samples) -> None:
    """Adds the positions of a plan before an instant."""
    for a, b in pairwise([*plan, *plan[-1:]]):
        end = a.ns + 1 if a is b else b.ns
        for ns in range(a.ns, min(end, until), _PERIOD_NS):
            samples.ns.append(ns)
            samples.q.append(_between(a, b, ns)[0])


def _begun(plan: list[_Point], start: int) -> _Point | None:
    """Where the plan so far has its joints when a new one begins; None: it has not begun."""
    if not plan or start < plan[0].ns:
        return None
    if start >= plan[-1].ns:
        return _Point(start, plan[-1].q, np.zeros(len(plan[-1].q)))
    k = next(i for i, p in enumerate(plan) if p.ns > start)
    return _Point(start, *_between(plan[k - 1], plan[k], start))


def _first_of_all(
    begun: _Point | None, whole: tuple[str, ...], start: int, measured: Measured,
    wanted: dict[str, float],
) -> list[_Point]:  # fmt: skip
    """Where all joints begin: as the plan before has them, as they were read, else as is wanted.

    Nothing where a joint's place is not known at all.
    """
    count = 0 if begun is None else len(begun.q)
    q, qd = np.empty(len(whole)), np.zeros(len(whole))
    if begun is not None:
        q[:count], qd[:count] = begun.q, qd[:count] if begun.qd is None else begun.qd
    for k, name in enumerate(whole[count:], count):
        read = measured((name,), start)
        if read is None and name not in wanted:
            return []
        q[k] = wanted[name] if read is None else read[0]
    return [_Point(start, q, qd)]


def _of_all(
    point: _Point, names: tuple[str, ...], whole: tuple[str, ...], begun: Sequence[_Point]
) -> _Point:
    """A point of some joints as one of all, the others held where they begin."""
    places = [whole.index(n) for n in names]
    q = begun[0].q.copy() if begun else np.full(len(whole), np.nan)
    q[places] = point.q
    if point.qd is None:
        return _Point(point.ns, q, None)
    qd = np.zeros(len(whole))
    qd[places] = point.qd
    return _Point(point.ns, q, qd)


def _between(a: _Point, b: _Point, ns: int) -> tuple[Array, Array]:
    """Position and velocity between two points."""
    if a is b:
        return a.q, np.zeros(len(a.q))
    span, part = (b.ns - a.ns) / _NS, (ns - a.ns) / (b.ns - a.ns)
    if a.qd is None or b.qd is None:
        return a.q + part * (b.q - a.q), (b.q - a.q) / span
    rise, rest = b.q - a.q, 1.0 - part
    bent = part * rest * span * (rest * a.qd - part * b.qd)
    q = a.q + part * part * (3.0 - 2.0 * part) * rise + bent
    qd = 6.0 * part * rest * rise / span
    qd = qd + rest * (1.0 - 3.0 * part) * a.qd + part * (3.0 * part - 2.0) * b.qd
    return q, qd


def _series(names: tuple[str, ...], samples: _Samples) -> JointSeries:
    return JointSeries(names, np.array(samples.ns), np.array(samples.q), None, None)
