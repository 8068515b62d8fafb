"""The mapping file: what the columns of a foreign table are, as one frozen model."""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, field_validator, model_validator

from wamctl.arm.config import Positive, Section, Vector, find_file, read_yaml, validate

PositionUnit = Literal["rad", "deg", "rev", "m", "mm"]
VelocityUnit = Literal["rad/s", "deg/s", "rev/s", "rpm", "m/s", "mm/s"]
EffortUnit = Literal["N m", "mN m", "N"]
TimeUnit = Literal["s", "ms", "us", "ns"]
Columns = Annotated[
    str | tuple[str | int, ...],
    Field(
        description="one column a joint, by name or by number from 1; or the name of one array"
        " with a column for each joint (.npz, .npy, .mat, .parquet)"
    ),
]
Count = Annotated[int, Field(ge=1)]
_FILE = Field(
    default=None,
    description="another table beside the imported one, with the same rows; unset: that one",
)
_LARGEST_CONDITION = 1e6
_CURRENTS = ("a", "ma", "amp", "amps", "ampere", "amperes")


class ColumnsSection(Section):
    """Where the numbers of one quantity stand, and what makes joint quantities of them."""

    columns: Columns
    entries: tuple[Count, ...] | None = Field(
        default=None,
        description="which columns of that array to take, one a joint, from 1; unset: all",
    )
    file: str | tuple[str, ...] | None = Field(
        default=None,
        description="another table beside the imported one, with the same rows, or one for each of"
        " the columns; unset: that one",
    )
    scale: Vector | None = Field(
        default=None,
        description="factor of each column onto the unit: a sign, counts, a torque constant",
    )
    side: Literal["joint", "motor"] = Field(
        default="joint", description="motor: the columns go through the motors' matrix"
    )

    @model_validator(mode="after")
    def _a_column_in_each_file(self) -> "ColumnsSection":
        if isinstance(self.file, tuple):
            columns = 1 if isinstance(self.columns, str) else len(self.columns)
            if len(self.file) != columns:
                raise ValueError(f"{len(self.file)} files for {columns} columns, not one for each")
        return self


class PositionSection(ColumnsSection):
    """Measured position."""

    unit: PositionUnit = "rad"
    offset: Vector | None = Field(
        default=None, description="added to each joint's position at the end [rad or m]"
    )


class VelocitySection(ColumnsSection):
    """Velocity, where the table has one."""

    unit: VelocityUnit = "rad/s"


class EffortSection(ColumnsSection):
    """Torque or force."""

    unit: EffortUnit = Field(
        default="N m", description="currents go in without a unit, as they are in ampere"
    )
    joint_from_motor: tuple[Vector, ...] | None = Field(
        default=None,
        description="matrix joint torque from motor torque; unset: motor_from_joint transposed",
    )

    @field_validator("unit", mode="before")
    @classmethod
    def _no_current(cls, unit: object) -> object:
        if isinstance(unit, str) and unit.strip().lower() in _CURRENTS:
            raise ValueError(
                f"{unit!r} is of a current: leave unit out, scale the columns to ampere, and let"
                " `--set torque_unit=A` (for `ident run` and `ident gap`) or `torque_unit: A`"
                " (under identification in the arm's file) estimate the drives' gains"
            )
        return unit


SeriesSection = PositionSection | VelocitySection | EffortSection


class TimeSection(Section):
    """When the rows were sampled: a column, or a constant rate."""

    column: str | int | None = Field(
        default=None,
        description="by name or by number from 1: numbers, or dates such as 2024-01-31T12:00:00.02",
    )
    file: str | None = _FILE
    unit: TimeUnit = "s"
    rate_hz: Positive | None = Field(default=None, description="samples a second [Hz]")

    @model_validator(mode="after")
    def _one_of_both(self) -> "TimeSection":
        if (self.column is None) == (self.rate_hz is None):
            raise ValueError("give either column or rate_hz")
        if self.file is not None and self.column is None:
            raise ValueError("file needs the column that holds the time")
        return self


class RowsSection(Section):
    """Which rows of the tables to take, counted from 1 after the header, both ends included."""

    first: Count = 1
    last: Count | None = None
    column: str | int | None = Field(
        default=None, description="take only rows in which this column has the value `equal`"
    )
    equal: float | None = Field(default=None, description="such as the number of an episode")

    @model_validator(mode="after")
    def _in_order(self) -> "RowsSection":
        if (self.column is None) != (self.equal is None):
            raise ValueError("give column and equal, or neither")
        if self.last is not None and self.last < self.first:
            raise ValueError(f"last {self.last} lies before first {self.first}")
        return self


class Mapping(Section):
    """A mapping file."""

    other_words: ClassVar[dict[str, str]] = {
        "torque": "effort",
        "tau": "effort",
        "current": "effort",
        "q": "position",
    }

    robot: str | None = Field(
        default=None,
        description="the arm's file or its URDF, which travels inside the log: beside this one, or"
        " shipped",
    )
    joints: tuple[str, ...] = Field(
        default=(), description="joint of each column; empty: the arm's joints"
    )
    header: bool = Field(default=True, description="whether a text table starts with names")
    delimiter: str = Field(
        default=",",
        min_length=1,
        max_length=1,
        description="of a text table; a blank: any white space",
    )
    skip: int = Field(default=0, ge=0, description="lines of a text table before its header")
    rows: RowsSection = RowsSection()
    time: TimeSection
    motor_from_joint: tuple[Vector, ...] | None = Field(
        default=None, description="matrix motor angle from joint angle [rad/rad]"
    )
    position: PositionSection
    command_position: PositionSection | None = Field(
        default=None, description="position that was asked for, by the same clock"
    )
    velocity: VelocitySection | None = None
    effort: EffortSection | None = Field(default=None, description="measured torque")
    command: EffortSection | None = Field(default=None, description="commanded torque")

    @model_validator(mode="after")
    def _fits_together(self) -> "Mapping":
        faults = []
        if not (self.effort or self.command or self.command_position):
            faults.append("give effort or command (a torque), or command_position")
        if not self.robot and not self.joints:
            faults.append("give joints, or the robot whose joints they are")
        if not self.header:
            faults += [
                f"{place}: the table has no header, so {name!r} is no column (give its number)"
                for place, name in self._named_columns()
            ]
        for place, part in self.series():
            if part.side == "motor" and not (self._own_matrix(part) or self.motor_from_joint):
                faults.append(f"{place}.side: motor, but motor_from_joint is missing")
        if self.joints:
            faults += self.lengths(len(self.joints))
        if faults:
            raise ValueError("; ".join(faults))
        return self

    def series(self) -> "Iterator[Series]":
        """The quantities that the file maps, each with its name."""
        for name in ("position", "command_position", "velocity", "effort", "command"):
            part = getattr(self, name)
            if part is not None:
                yield Series(name, part)

    def lengths(self, n: int) -> list[str]:
        """One sentence for each list whose length does not fit n joints."""
        faults = []
        for place, part in self.series():
            for name in ("columns", "entries", "scale", "offset"):
                value = getattr(part, name, None)
                if isinstance(value, tuple) and len(value) != n:
                    faults.append(f"{place}.{name}: {len(value)} entries for {n} joints")
            faults += _shape_faults(f"{place}.joint_from_motor", n, self._own_matrix(part))
        faults += _shape_faults("motor_from_joint", n, self.motor_from_joint)
        return faults + _inverse_faults("motor_from_joint", n, self.motor_from_joint)

    @staticmethod
    def _own_matrix(part: SeriesSection) -> tuple[Vector, ...] | None:
        return part.joint_from_motor if isinstance(part, EffortSection) else None

    def _named_columns(self) -> Iterator[tuple[str, str]]:
        if isinstance(self.time.column, str):
            yield "time.column", self.time.column
        for place, part in self.series():
            names = part.columns if isinstance(part.columns, tuple) else (part.columns,)
            yield from ((f"{place}.columns", n) for n in names if isinstance(n, str))


class Series(NamedTuple):
    """One quantity of the mapping with its name."""

    place: str
    part: SeriesSection


def _shape_faults(place: str, n: int, matrix: tuple[Vector, ...] | None) -> list[str]:
    if matrix is None or (len(matrix) == n and all(len(row) == n for row in matrix)):
        return []
    widths = "/".join(dict.fromkeys(str(len(row)) for row in matrix))
    return [f"{place}: {len(matrix)} rows of {widths} entries for {n} joints"]


def _inverse_faults(place: str, n: int, matrix: tuple[Vector, ...] | None) -> list[str]:
    if matrix is None or _shape_faults(place, n, matrix):
        return []
    condition = np.linalg.cond(np.array(matrix))
    if condition < _LARGEST_CONDITION:
        return []
    return [f"{place}: the matrix cannot be inverted (condition number {condition:.3g})"]


def load_mapping(path: Path | str) -> tuple[Mapping, Path]:
    """The mapping of a file, and where the file was found.

    Raises:
        ConfigurationError: missing or broken file, or all faults of its content at once.
    """
    found = find_file(path)
    return validate(Mapping, read_yaml(found), found), found
