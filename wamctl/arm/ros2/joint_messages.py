"""Joint messages of a bag as arrays: thousands at once where they are alike, else one by one."""

from collections.abc import Sequence
from functools import cache
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.serde import SerdeError

from wamctl.arm.arrays import Array
from wamctl.arm.errors import DataError
from wamctl.arm.ros2.cdr import JOINT_STATE, TRAJECTORY_POINT, columns
from wamctl.arm.ros2.joint_series import JointSeries, ReferenceSeries, Stamps

JOINT_STATE_TYPE = "sensor_msgs/msg/JointState"
TRAJECTORY_POINT_TYPE = "trajectory_msgs/msg/JointTrajectoryPoint"


def joint_series(messages: Sequence[bytes], log_ns: Sequence[int]) -> list[JointSeries]:
    """JointState messages as arrays, one series for each run of messages with the same joints.

    Args:
        messages: CDR.
        log_ns: instants of recording [ns], which stand in for headers without a stamp.

    Raises:
        DataError: a message that is no JointState, or whose arrays do not fit its names.
    """
    found = _alike(messages, JOINT_STATE)
    if found is None:
        return _joint_states_one_by_one(messages, log_ns)
    names, numbers = found
    stamps = _stamps(numbers, log_ns)
    return [_series(names, stamps, numbers["position"], numbers["velocity"], numbers["effort"])]


def reference_series(messages: Sequence[bytes], log_ns: Sequence[int]) -> ReferenceSeries | None:
    """JointTrajectoryPoint messages as arrays; None when their points have different sizes.

    Args:
        messages: CDR.
        log_ns: instants of recording [ns]; the message itself has no stamp.

    Raises:
        DataError: a message that is no JointTrajectoryPoint.
    """
    found = _alike(messages, TRAJECTORY_POINT)
    fields = ("positions", "velocities", "accelerations")
    if found is not None:
        q, qd, qdd = (found[1][f] for f in fields)
    else:
        points = [decoded(m, TRAJECTORY_POINT_TYPE) for m in messages]
        if len({len(getattr(p, f)) for p in points for f in fields}) != 1:
            return None
        q, qd, qdd = (np.array([getattr(p, f) for p in points]) for f in fields)
    if not q.shape == qd.shape == qdd.shape:
        return None
    return ReferenceSeries(np.array(log_ns, dtype=np.int64), q, qd, qdd)


def _alike(
    messages: Sequence[bytes], fields: Any
) -> tuple[tuple[str, ...], dict[str, NDArray]] | None:
    try:
        found = columns(messages, fields)
    except ValueError:
        return None
    return None if found is None else (found[0].texts.get("name", ()), found[1])


def _stamps(numbers: dict[str, NDArray], log_ns: Sequence[int]) -> Stamps:
    header = numbers["sec"].ravel() * np.int64(1_000_000_000) + numbers["nanosec"].ravel()
    return np.where(header == 0, np.array(log_ns, dtype=np.int64), header)


def _joint_states_one_by_one(messages: Sequence[bytes], log_ns: Sequence[int]) -> list[JointSeries]:
    found = [(decoded(m, JOINT_STATE_TYPE), t) for m, t in zip(messages, log_ns, strict=True)]
    runs = groupby(found, key=lambda pair: _shape(pair[0]))
    return [_run([m for m, _ in run], [t for _, t in run]) for run in (list(r) for _, r in runs)]


def _shape(message: Any) -> tuple[object, ...]:
    lengths = (len(message.position), len(message.velocity), len(message.effort))
    return (*message.name, *lengths)


def _run(messages: list[Any], log_ns: list[int]) -> JointSeries:
    numbers = {
        "sec": np.array([m.header.stamp.sec for m in messages]),
        "nanosec": np.array([m.header.stamp.nanosec for m in messages]),
    }
    arrays = [
        np.array([getattr(m, f) for m in messages], dtype=float)
        for f in ("position", "velocity", "effort")
    ]
    return _series(tuple(messages[0].name), _stamps(numbers, log_ns), *arrays)


def _series(
    names: tuple[str, ...], stamps: Stamps, q: Array, qd: Array, effort: Array
) -> JointSeries:
    for what, array in (("positions", q), ("velocities", qd), ("efforts", effort)):
        if array.shape[1] not in (0, len(names)):
            raise DataError(
                f"The JointState at {stamps[0]} ns has {len(names)} names"
                f" and {array.shape[1]} {what}."
            )
    return JointSeries(names, stamps, *(a if a.shape[1] else None for a in (q, qd, effort)))


@cache
def _typestore() -> Any:
    # Here, since only odd messages need it and it takes a tenth of a second to load.
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.LATEST)


def decoded(message: bytes, kind: str) -> Any:
    """A message of a published type.

    Raises:
        DataError: it is none.
    """
    try:
        return _typestore().deserialize_cdr(message, kind)
    except SerdeError as error:
        raise DataError(f"A message is not a {kind} ({error}).") from error
