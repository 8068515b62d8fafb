"""A foreign table as a recording: columns, units, motors to joints, offsets."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ident.importers.columns import files, read_columns
from ident.importers.mapping import (
    EffortSection,
    Mapping,
    PositionSection,
    SeriesSection,
    load_mapping,
)
from ident.recordings.loading import fingerprint
from ident.signals.arrays import Array
from wamctl.arm.config import beside, find_file, load_robot_file, read_text
from wamctl.arm.errors import ConfigurationError, DataError
from wamctl.arm.recorder import write_recording
from wamctl.arm.recording import Command, Recording
from wamctl.arm.robot import load_robot
from wamctl.arm.ros2.magnitudes import POSITION, TORQUE, excess

LEFT_OUT = "rows left out"
"""Key of a log's metadata that tells which rows of its table it lacks."""

_UNITS = {
    "rad": 1.0,
    "deg": np.pi / 180,
    "rev": 2 * np.pi,
    "m": 1.0,
    "mm": 1e-3,
    "rad/s": 1.0,
    "deg/s": np.pi / 180,
    "rev/s": 2 * np.pi,
    "rpm": 2 * np.pi / 60,
    "m/s": 1.0,
    "mm/s": 1e-3,
    "N m": 1.0,
    "mN m": 1e-3,
    "N": 1.0,
}


@dataclass(frozen=True)
class _Arm:
    joints: tuple[str, ...]
    attachments: dict[str, bytes]


def import_recording(source: Path, mapping: Path | str, out: Path) -> Recording:
    """Writes a foreign table as a log; nothing is written when anything is at fault.

    Args:
        source: the table (.csv or other text, .parquet, .npz, .mat).
        mapping: the mapping file, or the bare name of a shipped one.
        out: the log to write.

    Returns:
        The recording as written.

    Raises:
        ConfigurationError: all faults of the mapping, or of mapping and table together, at once.
        DataError: a table that cannot be read, or that holds something else than finite numbers
            of a joint's size. A few rows with cells that are not finite are left out.
    """
    recording = mapped_recording(source, mapping)
    write_recording(out, recording)
    return recording


def mapped_recording(source: Path, mapping: Path | str) -> Recording:
    """The recording in a foreign table; arguments and errors are those of `import_recording`."""
    plan, where = load_mapping(mapping)
    arm = _arm(plan, where)
    columns = read_columns(source, plan, where, arm.joints)
    q = _joint_side(plan.position, columns.series["position"], plan)
    wanted, qd, effort, command = (
        _joint_side(part, columns.series[place], plan) if part else None
        for place, part in (
            ("command_position", plan.command_position),
            ("velocity", plan.velocity),
            ("effort", plan.effort),
            ("command", plan.command),
        )
    )
    for parts in (
        {"position": q, "command_position": wanted},
        {"effort": effort, "command": command},
    ):
        _bounded(source, columns.rows, arm, parts)
    files_read = {path.name: f"sha256 {fingerprint(path)}" for path in files(source, plan)}
    return Recording(
        arm.joints,
        columns.stamp_ns,
        q,
        qd,
        effort,
        None
        if command is None and wanted is None
        else Command(columns.stamp_ns, wanted, None, command),
        metadata=files_read | _left_out(columns.left_out),
        attachments=arm.attachments | {"mapping.yaml": where.read_bytes()},
    )


def _left_out(rows: Sequence[int]) -> dict[str, str]:
    """What the log's metadata say of rows that it lacks."""
    if not rows:
        return {}
    count = f"{len(rows)} rows have" if len(rows) > 1 else "a row has"
    which = f"the first is row {rows[0]}" if len(rows) > 1 else f"row {rows[0]}"
    return {LEFT_OUT: f"{count} cells that are not finite: {which}"}


def _bounded(
    source: Path, rows: NDArray[np.intp], arm: _Arm, parts: dict[str, Array | None]
) -> None:
    """Refuse what no joint can have.

    Raises:
        DataError: a table with such numbers.
    """
    for place, values in parts.items():
        most = POSITION if "position" in place else TORQUE
        if values is not None:
            wrong = excess(values, most, arm.joints, lambda s: f"in row {rows[s]}")
            if wrong:
                raise DataError(f"{source}: {place} {wrong}")


def _arm(plan: Mapping, where: Path) -> _Arm:
    """Joints and, where the mapping names the arm, its files."""
    if plan.robot is None:
        return _Arm(plan.joints, {})
    near = beside(where, plan.robot)
    file = near if near.is_file() else find_file(plan.robot)
    joints, urdf_path, attachments = plan.joints, file, {}
    if file.suffix in (".yaml", ".yml"):
        section = load_robot_file(file).robot
        joints, urdf_path = section.joints, beside(file, section.urdf)
        attachments["config.yaml"] = file.read_bytes()
    urdf = read_text(urdf_path)
    robot = load_robot(urdf, joints, source=urdf_path)
    if plan.joints and set(plan.joints) != set(robot.joint_names):
        named, known = ", ".join(plan.joints), ", ".join(robot.joint_names)
        fault = f"joints: {named} are not those of {file.name}, which are {known}"
        raise ConfigurationError(where, [fault])
    return _Arm(plan.joints or robot.joint_names, attachments | {"robot.urdf": urdf.encode()})


def _joint_side(part: SeriesSection, raw: Array, plan: Mapping) -> Array:
    """Joint quantities in SI units, shape (S, n)."""
    values = raw * _UNITS[part.unit] * np.array(part.scale or 1.0)
    if part.side == "motor":
        values = _from_motors(part, values, plan)
    return values + np.array(part.offset or 0.0) if isinstance(part, PositionSection) else values


def _from_motors(part: SeriesSection, values: Array, plan: Mapping) -> Array:
    """The motors' quantities as the joints', shape (S, n)."""
    if isinstance(part, EffortSection) and part.joint_from_motor:
        return values @ np.array(part.joint_from_motor).T
    motor_from_joint = np.array(plan.motor_from_joint)
    if isinstance(part, EffortSection):
        return values @ motor_from_joint
    return values @ np.linalg.inv(motor_from_joint).T
