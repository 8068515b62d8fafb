"""The noise floor: how much the residual differs when the same motion is repeated."""

import numpy as np
import yaml
from numpy.typing import NDArray

from ident.gap.experiment import Experiment
from ident.gap.region import Region
from ident.gap.residual import Residual
from ident.gap.table import Nominal, Table
from wamctl.arm.config import validate
from wamctl.arm.errors import ConfigurationError
from wamctl.arm.recording import Recording
from wamctl.arm.trajectory import TrajectoryFile

Array = NDArray[np.floating]

_TRAJECTORY = "trajectory.yaml"
_SAME_PLACE = 0.01  # rad: two rows count as repeats when no joint is further away
_LEAST_PAIRS = 20


def trajectory_file(recording: Recording, name: str) -> TrajectoryFile | None:
    """The excitation that travels inside a log, if one does.

    Raises:
        ConfigurationError: it is invalid.
    """
    if _TRAJECTORY not in recording.attachments:
        return None
    source = f"{name}:{_TRAJECTORY}"
    try:
        content = yaml.safe_load(recording.attachments[_TRAJECTORY])
    except yaml.YAMLError as error:
        raise ConfigurationError(source, [f"not valid YAML ({error})"]) from error
    return validate(TrajectoryFile, content, source)


def noise_floor(
    source: Experiment, rows: Nominal, table: Table, left: list[Residual]
) -> Array | None:
    """Rms noise per joint and region [N m], shape (n, regions), from one period to the next.

    What the model gets wrong in the same way each time cancels in the difference of two periods.
    None where no motion is repeated; not-a-number for a region without repeats, and for joints
    that are held.
    """
    first, second = pairs(source, rows, table)
    if len(first) < _LEAST_PAIRS:
        return None
    floor = np.full((len(left), len(Region)), np.nan)
    for j, r in enumerate(left):
        if len(r.values) == 0:
            continue
        for region in Region:
            here = (r.region[first] == region) & (r.region[second] == region)
            if here.sum() >= _LEAST_PAIRS:
                change = r.values[second[here]] - r.values[first[here]]
                floor[j, region] = np.sqrt(np.mean(change**2) / 2)
    return floor


def pairs(
    source: Experiment, rows: Nominal, table: Table
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows of one period, and the same rows of the next."""
    hop_s = rows.windows.hop / rows.windows.rate_hz
    log = np.array([s.log for s in rows.stretches])[table.stretch]
    q = np.concatenate([rows.windows.mean(s.q) for s in rows.stretches])
    first, second = [], []
    for number, (recording, data) in enumerate(
        zip(source.recordings, source.datasets, strict=True)
    ):
        file = trajectory_file(recording, data.name)
        if file is None:
            continue
        step = 2 * np.pi / file.fundamental_rad_s / hop_s
        here = np.flatnonzero(log == number)
        place = {round(float(t) / hop_s): i for i, t in zip(here, table.t[here], strict=True)}
        for k, i in place.items():
            j = place.get(k + round(step))
            if j is not None and np.abs(q[j] - q[i]).max() < _SAME_PLACE:
                first.append(i)
                second.append(j)
    return np.array(first, dtype=np.int64), np.array(second, dtype=np.int64)
