"""One log, read once: what it is, what the checks say, and its triangles."""

import hashlib
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from ident.checks.examine import OF_FITS, examine
from ident.checks.remark import Grade, verdict_of
from ident.fleet.arm_type import arm_type
from ident.fleet.columns import Columns
from ident.fleet.settings import FleetSettings
from ident.fleet.triangles import of_rows, packed
from ident.model.arm import Arm, arm_from_file
from ident.recordings.dataset import Dataset
from ident.recordings.loading import Reading, fingerprint, read_for, read_logs
from ident.regression.filters import Processing, processing
from ident.regression.rows import Regressor, rows_of
from ident.regression.triangles import triangle
from wamctl.arm.errors import UserError

Array = NDArray

VERSION = 3
"""Of the reduction: logs that another one has reduced are reduced again."""

_MOST_ROWS = 4000  # gathered before they become a triangle
_WHITE = 2.0  # independent values a second of a signal, per hertz of its bandwidth


@dataclass(frozen=True)
class Reduced:
    """One log, reduced; a log that cannot be used has a sentence and no triangles.

    Attributes:
        hash: SHA-256 of its bytes.
        metadata: facts that the log states of itself.
        first_ns: stamp of the first message [ns]; None where it could not be read.
        duration_s: of its used samples [s].
        arm: name of the arm's model.
        type: what the arm's columns follow from: arms of one type share them.
        verdict: of the checks: `trustworthy`, `doubtful` or `refused`.
        remarks: codes and sentences.
        triangles: see `packed`; None where there are none.
        rows: number of rows of each joint, n of them.
        rows_per_value: rows for each independent value: a low-pass leaves fewer of these.
        facts: what the columns stand for, see `ident.fleet.arm_type`, as JSON.
    """

    hash: str
    metadata: dict[str, str]
    first_ns: int | None
    duration_s: float
    arm: str
    type: str
    verdict: str
    remarks: tuple[tuple[str, str], ...]
    triangles: bytes | None = None
    rows: tuple[int, ...] = ()
    rows_per_value: float = 1.0
    facts: str = ""


@threadpool_limits.wrap(limits=1)
def reduced(path: Path, robot: Path | None, reading: Reading, settings: FleetSettings) -> Reduced:
    """Reduce one log; whatever is wrong with it becomes its sentence.

    Args:
        path: the log on this machine.
        robot: file that describes the arm; None: what travels inside the log.
        reading: topics and torque to read.
        settings: of the fleet.
    """
    digest = fingerprint(path)
    found = Reduced(digest, {}, None, 0.0, "", "", Grade.REFUSED.word, ())
    try:
        arm, data = _read(path, robot, reading)
        metadata: dict[str, str] = {}
        for piece in data.source.pieces():
            metadata |= piece.metadata
        arm = with_offset(arm)
        found = replace(found, metadata=metadata, first_ns=data.source.first_ns, arm=arm.name)
        return _reduced(replace(found, type=type_of(arm, settings)), arm, data, settings)
    except UserError as error:
        return replace(found, remarks=(*found.remarks, ("unusable", _without(str(error), path))))
    except (ValueError, ArithmeticError, np.linalg.LinAlgError) as error:
        sentence = f"{path.name} could not be reduced ({type(error).__name__}: {error})."
        return replace(found, remarks=(*found.remarks, ("unusable", sentence)))


def _read(path: Path, robot: Path | None, reading: Reading) -> tuple[Arm, Dataset]:
    """The log and its arm; a configuration is read once only, a URDF's joints are the log's."""
    if robot is None or robot.suffix not in (".yaml", ".yml"):
        arm, (data,) = read_logs([path], robot, reading)
        return arm, data
    arm = _configured(robot)
    return arm, read_for(arm, path, reading)


@lru_cache(maxsize=4)
def _configured(robot: Path) -> Arm:
    return arm_from_file(robot, ())


def with_offset(arm: Arm) -> Arm:
    """The arm with a constant torque at each joint among its terms: it may come and go."""
    terms = {*arm.settings.terms} - {"auto"} | {"viscous", "coulomb", "offset"}
    return arm.with_settings(terms=sorted(terms))


def _without(sentence: str, path: Path) -> str:
    """The sentence with the log's name alone: where it lay when it was read is no matter."""
    return sentence.replace(str(path), path.name)


def _reduced(found: Reduced, arm: Arm, data: Dataset, settings: FleetSettings) -> Reduced:
    examined = examine(arm, [data])
    remarks = [r for r in examined.remarks if r.code not in OF_FITS]
    verdict = verdict_of(remarks)
    found = replace(
        found,
        duration_s=data.samples / data.rate_hz,
        verdict=verdict.word,
        remarks=tuple((r.code, r.sentence) for r in remarks),
    )
    if verdict is Grade.REFUSED:
        return found
    columns, facts = _of_type(found.type, arm, settings)
    process = process_of(arm, examined.data[0], columns)
    parts, count = joint_triangles(examined.data[0], columns, process, settings)
    return replace(
        found,
        triangles=packed([of_rows(j, R) for j, R in sorted(parts.items())], columns.count + 1),
        rows=tuple(count),
        rows_per_value=_rows_per_value(process, examined.data[0].rate_hz),
        facts=facts,
    )


_known: dict[str, tuple[Columns, str]] = {}
"""Of the type that this process saw last: most logs of a fleet are of one."""


def _of_type(name: str, arm: Arm, settings: FleetSettings) -> tuple[Columns, str]:
    """The columns of a type, and its facts."""
    if name not in _known:
        columns = Columns(arm, settings.stribeck_speeds_rad_s)
        _known.clear()
        _known[name] = columns, arm_type(columns).text()
    return _known[name]


def process_of(arm: Arm, data: Dataset, columns: Columns) -> Processing:
    """The filters of a recording, with the curves of friction at low speed.

    Friction changes its sign at once, and rows of a slow joint are left out, as in the paper's way:
    the curve that it turns round along would have to be chosen for all logs together.
    """
    return replace(processing(arm, data), curves=columns.curves)


def joint_triangles(
    data: Dataset, columns: Columns, process: Processing, settings: FleetSettings
) -> tuple[dict[int, Array], list[int]]:
    """Triangles of [X | tau], shape (p + 1, p + 1), by moving joint, and rows of every joint.

    Args:
        data: the recording.
        columns: of the arm.
        process: the filters.
        settings: of the fleet.

    Raises:
        TooShortError: no stretch is long enough for the filter.
    """
    arm = columns.arm
    threshold = process.threshold_rad_s or settings.slowest_rad_s
    regressor = Regressor(arm.robot, arm.terms, columns.base, data.moving, columns.further)
    joints = np.flatnonzero(data.moving)
    parts: dict[int, Array] = {}
    count = [0] * len(data.moving)
    for rows in rows_of(data, process, regressor):
        kept = np.abs(rows.speed) >= threshold
        for place, j in enumerate(joints):
            own = kept[:, place], place
            wide = columns.wide(int(j), rows.W[own], rows.curves[own], rows.tau[own])
            count[j] += len(wide)
            for first in range(0, len(wide), _MOST_ROWS):
                part = wide[first : first + _MOST_ROWS]
                known = [parts[int(j)]] if int(j) in parts else []
                parts[int(j)] = triangle(np.concatenate([*known, part]))
    return parts, count


def _rows_per_value(process: Processing, rate_hz: float) -> float:
    """Rows for each independent value: a low-pass leaves fewer of these than rows are kept."""
    return max(1.0, rate_hz / process.row_every / (_WHITE * process.cutoff_hz))


def type_of(arm: Arm, settings: FleetSettings) -> str:
    """The arm's name with a digest of all that its columns follow from."""
    text = "\n".join(
        map(
            repr,
            (
                arm.robot.urdf,
                arm.robot.joint_names,
                arm.settings,
                arm.terms,
                settings.reduction,
                VERSION,
            ),
        )
    )
    return f"{arm.name}-{hashlib.sha256(text.encode()).hexdigest()[:12]}"
