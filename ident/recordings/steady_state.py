"""Where a recording is in steady state: whole periods of its excitation (46), without ramps."""

from collections.abc import Iterator
from dataclasses import replace
from functools import reduce
from itertools import groupby
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from ident.model.attachments import HasAttachments, attached_trajectory
from ident.recordings.dataset import Dataset, Segment, Span
from wamctl.arm.trajectory import FourierSeries, sample

_TOLERANCE = 1e-6
_PROBES = 9


def only_steady_state(data: Dataset, carrier: HasAttachments, name: str) -> Dataset:
    """The dataset, with rows wanted only from the counted periods of its excitation.

    A log without trajectory or reference stays as it is.

    Raises:
        ConfigurationError: the trajectory inside the log is invalid.
    """
    file = attached_trajectory(carrier, name) if data.has_reference else None
    if file is None:
        return data
    series = FourierSeries(
        file.joints, file.fundamental_rad_s, np.array(file.a), np.array(file.b), np.array(file.q0)
    )
    count = round(file.periods * series.period_s * data.rate_hz)
    if len(series.q0) != len(data.moving):
        return data
    spans = tuple(
        _counted(data.spans[number], (part for _, part in parts), series, count, data.rate_hz)
        for number, parts in groupby(data.read(), key=itemgetter(0))
    )
    return replace(data, spans=spans) if any(s.used[1] for s in spans) else data


def _counted(
    span: Span, parts: Iterator[Segment], series: FourierSeries, count: int, rate_hz: float
) -> Span:
    """The span with the samples marked in which its reference is the series; perhaps none.

    The series starts where its first sample, and some later ones, all stand in their places.
    """
    places = np.linspace(0, count - 1, _PROBES).astype(int)
    motion, _, _ = sample(series, places.astype(float) / rate_hz)
    starts: list[list[NDArray[np.intp]]] = [[] for _ in places]
    first = 0
    for part in parts:
        if part.reference is None:
            continue
        for found, place, q in zip(starts, places, motion, strict=True):
            near = np.abs(part.reference - q).max(axis=1) < _TOLERANCE
            found.append(np.flatnonzero(near) + first - place)
        first += len(part.reference)
    common = reduce(np.intersect1d, [np.concatenate(s) if s else np.empty(0) for s in starts])
    inside = common[(common >= 0) & (common + count <= span.length)]
    start = int(inside[0]) if len(inside) else 0
    return replace(span, used=(start, start + count) if len(inside) else (0, 0))
