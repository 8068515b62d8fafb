"""Where a recording is in steady state: whole periods of its excitation (46), without ramps."""

from dataclasses import replace

import numpy as np
import yaml
from numpy.typing import NDArray

from ident.dataset import Dataset, Segment
from wamctl.arm.config import validate
from wamctl.arm.errors import ConfigurationError
from wamctl.arm.recording import Recording
from wamctl.arm.trajectory import FourierSeries, TrajectoryFile, sample

Array = NDArray[np.floating]

_TRAJECTORY = "trajectory.yaml"
_TOLERANCE = 1e-6
_PROBES = 9


def only_steady_state(data: Dataset, recording: Recording, name: str) -> Dataset:
    """The dataset, with rows wanted only from the counted periods of its excitation.

    A log without trajectory or reference stays as it is.

    Raises:
        ConfigurationError: the trajectory inside the log is invalid.
    """
    if _TRAJECTORY not in recording.attachments:
        return data
    file = _trajectory(recording.attachments[_TRAJECTORY], f"{name}:{_TRAJECTORY}")
    series = FourierSeries(
        file.joints, file.fundamental_rad_s, np.array(file.a), np.array(file.b), np.array(file.q0)
    )
    count = round(file.periods * series.period_s * data.rate_hz)
    segments = tuple(_counted(s, series, count, data.rate_hz) for s in data.segments)
    found = tuple(s for s in segments if s.used is not None)
    return replace(data, segments=found) if found else data


def _trajectory(text: bytes, source: str) -> TrajectoryFile:
    try:
        content = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ConfigurationError(source, [f"not valid YAML ({error})"]) from error
    return validate(TrajectoryFile, content, source)


def _counted(segment: Segment, series: FourierSeries, count: int, rate_hz: float) -> Segment:
    """The segment with the stretch marked in which its reference is the series."""
    wanted = segment.reference
    if wanted is None or len(wanted) < count or wanted.shape[1] != len(series.q0):
        return segment
    places = np.linspace(0, count - 1, _PROBES).astype(int)
    motion, _, _ = sample(series, places.astype(float) / rate_hz)
    near = np.abs(wanted[: len(wanted) - count + 1] - motion[0]).max(axis=1) < _TOLERANCE
    for start in np.flatnonzero(near):
        if np.abs(wanted[start + places] - motion).max() < _TOLERANCE:
            return replace(segment, used=(int(start), int(start) + count))
    return segment
