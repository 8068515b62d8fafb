"""All recordings of one identification, reduced, with the base parameters that they share."""

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.base_parameters import BaseMap, Posture, base_map
from ident.estimation.bounds import bounds
from ident.estimation.feasible_set import Constraint, LinkSize, feasible_set, link_sizes
from ident.estimation.instrumental_variables import Moments, moments
from ident.estimation.problem import Problem, prior_parameters
from ident.estimation.reversal_shapes import KnownShapes, WideProducts, at_once, chosen_reversals
from ident.model.arm import Arm
from ident.recordings.dataset import Dataset
from ident.regression.filters import Processing, processing
from ident.regression.processes import in_processes
from ident.regression.reduction import BLOCKS, Reduction, Reversals, Unmixed, reduction
from ident.regression.rows import Regressor, Rows, rows_of
from ident.regression.triangles import least_squares, merged, squared_error
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError

Progress = Callable[[float], None]

FOLDS = 3
"""Every third pair of stretches is held out in turn."""

_WORTH_PROCESSES = 200_000
"""With fewer samples in all, starting processes takes longer than they save."""


@dataclass(frozen=True)
class ReducedRecording:
    """One recording on its way into the fit.

    Attributes:
        data: its samples.
        process: its filters.
        reduction: its rows, reduced.
        moments: products with instruments, where these are wanted.
    """

    data: Dataset
    process: Processing
    reduction: Reduction
    moments: Moments | None = None

    def only(self, stretches: NDArray[np.bool_]) -> "ReducedRecording":
        """The same recording, with only some of its stretches, shape (BLOCKS,)."""
        moments = self.moments and self.moments.only(stretches)
        return replace(self, reduction=self.reduction.only(stretches), moments=moments)


@dataclass(frozen=True)
class RegressionData:
    """What the estimators know.

    Attributes:
        arm: the robot and its settings.
        base: the base parameters.
        logs: the recordings.
        prior: delta of the CAD model, shape (p,).
        sizes: each link's size.
        constraints: the set D.
        reversals: how friction turns round, and how much the rows near a reversal count in a fit.
        products: of which that was chosen; None where it was given, or is no choice.
    """

    arm: Arm
    base: BaseMap
    logs: tuple[ReducedRecording, ...]
    prior: Array
    sizes: dict[int, LinkSize]
    constraints: list[Constraint]
    reversals: Reversals
    products: WideProducts | None = None

    @cached_property
    def triangles(self) -> Array:
        """Of all logs, stretches, and joints, shape (logs, BLOCKS, n, b + 1, b + 1)."""
        return np.stack([log.reduction.R for log in self.logs])

    @cached_property
    def fitted_triangles(self) -> Array:
        """The same with the rows weighted as a fit has them."""
        return np.stack([log.reduction.R_fit for log in self.logs])

    @cached_property
    def by_joint(self) -> Array:
        """Of a fit's rows, of all logs and joints, shape (logs, n, b + 1, b + 1)."""
        stretches = np.swapaxes(self.fitted_triangles, 1, 2)
        return np.array([[merged(joint) for joint in log] for log in stretches])

    @cached_property
    def counts(self) -> NDArray[np.int64]:
        """Number of rows in each, shape (logs, BLOCKS, n)."""
        return np.stack([log.reduction.count for log in self.logs])

    @property
    def moving(self) -> NDArray[np.bool_]:
        """Joints that move in any recording, shape (n,)."""
        return np.any([log.data.moving for log in self.logs], axis=0)

    def problem(self, weights: Array | None = None) -> Problem:
        """The regression of all rows, perhaps weighted.

        Args:
            weights: of each log's and joint's rows, shape (logs, n); None: all alike, as in (15).
        """
        triangles = self.by_joint if weights is None else self.by_joint * weights[..., None, None]
        rows = int(self.counts.sum())
        return Problem(self.base, merged(triangles), rows, self.prior, self.sizes, self.constraints)

    def only(self, stretches: NDArray[np.bool_]) -> "RegressionData":
        """The same recordings, with only some of their stretches.

        Args:
            stretches: which to keep, shape (BLOCKS,).
        """
        return replace(self, logs=tuple(log.only(stretches) for log in self.logs))


@dataclass(frozen=True)
class _UnmixedRecording:
    """A recording before it is known how friction turns round."""

    data: Dataset
    process: Processing
    rows: Unmixed
    moments: Moments | None

    def with_columns(self, places: Sequence[int]) -> "_UnmixedRecording":
        """The same recording, with only some columns of W."""
        moments = self.moments and self.moments.with_columns(places)
        return replace(self, rows=self.rows.with_columns(places), moments=moments)


def held_out(fold: int) -> NDArray[np.bool_]:
    """The stretches that a fold holds out, shape (BLOCKS,): every third pair of neighbours."""
    return (np.arange(BLOCKS) // 2) % FOLDS == fold


def _no_progress(share: float) -> None:
    """Tells nobody."""


@dataclass(frozen=True)
class Collected:
    """Recordings as rows that have the columns of several models, which differ in their terms.

    Attributes:
        bases: base parameters of each model, by its terms.
        columns: names of the parameters that the columns belong to.
        logs: the recordings.
        known: how friction turns round, where a model says so.
    """

    bases: dict[tuple[str, ...], BaseMap]
    columns: tuple[str, ...]
    logs: tuple[_UnmixedRecording, ...]
    known: KnownShapes | None

    def of(self, arm: Arm) -> RegressionData:
        """What the estimators know of one of the models."""
        base = self.bases[arm.settings.terms]
        places = [self.columns.index(p.name) for p in base.kept_parameters]
        found = [log.with_columns(places) for log in self.logs]
        reversals, products = _reversals(found, base, self.known)
        logs = tuple(
            ReducedRecording(x.data, x.process, x.rows.along(reversals), x.moments) for x in found
        )
        prior = prior_parameters(arm.robot, base)
        sizes = link_sizes(prior, base.parameters)
        constraints = feasible_set(base.parameters, sizes, arm.settings.feasible_set)
        constraints += bounds(arm.settings, base.parameters, prior)
        return RegressionData(arm, base, logs, prior, sizes, constraints, reversals, products)


def reduce_recordings(
    data: Sequence[Dataset],
    arm: Arm,
    progress: Progress = _no_progress,
    known: KnownShapes | None = None,
) -> RegressionData:
    """Recordings filtered, turned into rows, and reduced.

    Args:
        data: the recordings, joints in the robot's order.
        arm: the robot and its settings.
        progress: called with the share that is done, again and again.
        known: how friction turns round, where a model says so; None: the data choose.

    Raises:
        DataError: recordings from which nothing can be learned.
    """
    return collect(data, [arm], progress, known).of(arm)


def collect(
    data: Sequence[Dataset],
    arms: Sequence[Arm],
    progress: Progress = _no_progress,
    known: KnownShapes | None = None,
) -> Collected:
    """Recordings filtered and turned into rows, once for several models.

    Args:
        data: the recordings, joints in the robot's order.
        arms: alike but for their terms; the last one has the terms of all.
        progress: called with the share that is done, again and again.
        known: how friction turns round, where a model says so; None: the data choose.

    Raises:
        DataError: recordings from which nothing can be learned.
    """
    postures, widest = [posture(d) for d in data], arms[-1]
    bases: dict[tuple[str, ...], BaseMap] = {
        a.settings.terms: base_map(a.robot, a.terms, postures) for a in arms
    }
    if not all(base.kept for base in bases.values()):
        raise DataError(f"{data[0].name}: no parameter of the model has an effect on this motion.")
    wanted = {p.name for base in bases.values() for p in base.kept_parameters}
    base = bases[widest.settings.terms]
    kept = tuple(i for i, p in enumerate(base.parameters) if p.name in wanted)
    unmixed = partial(_unmixed, arm=widest, base=replace(base, kept=kept), known=known)
    names = tuple(base.parameters[i].name for i in kept)
    return Collected(bases, names, tuple(_all_unmixed(data, unmixed, progress)), known)


def _reversals(
    found: Sequence[_UnmixedRecording], base: BaseMap, known: KnownShapes | None
) -> tuple[Reversals, WideProducts | None]:
    """How friction turns round, and the products of which it was chosen."""
    n = len(found[0].data.moving)
    places = np.full(n, -1)
    for place, parameter in enumerate(base.kept_parameters):
        if parameter.kind == "fc":
            places[parameter.index - 1] = place
    if not found[0].process.curves:
        return at_once(places), None
    if known is not None:
        return replace(at_once(places), shapes=known.shapes), None
    products = WideProducts(
        np.sum([x.rows.products() for x in found], axis=0),
        np.sum([x.rows.count.sum(axis=0) for x in found], axis=0),
        places,
    )
    return chosen_reversals(products), products


def posture(data: Dataset) -> Posture:
    """Where the held joints of a recording are; a moving one may be anywhere.

    What columns depend on each other does not change with the range that a joint moves in.
    """
    return Posture(data.place, np.where(data.moving, np.pi, 0.0))


def _all_unmixed(
    data: Sequence[Dataset], unmixed: Callable[..., _UnmixedRecording], progress: Progress
) -> list[_UnmixedRecording]:
    """All recordings reduced, in several processes where that pays."""
    workers = min(len(data), os.cpu_count() or 1)
    if workers == 1 or sum(d.samples for d in data) < _WORTH_PROCESSES:
        return [
            unmixed(d, progress=lambda share, i=i: progress((i + share) / len(data)))
            for i, d in enumerate(data)
        ]
    logs = []
    for log in in_processes(partial(unmixed, progress=_no_progress), data, workers):
        logs.append(log)
        progress(len(logs) / len(data))
    return logs


def _unmixed(
    data: Dataset, arm: Arm, base: BaseMap, known: KnownShapes | None, progress: Progress
) -> _UnmixedRecording:
    process = processing(arm, data) if known is None else processing(arm, data, known.curves)
    regressor = Regressor(arm.robot, arm.terms, base, data.moving)
    stream = _with_progress(rows_of(data, process, regressor), data.span_s, progress)
    reduced = reduction(stream, data.span_s, process.threshold_rad_s, data.moving)
    products = moments(data, process, regressor) if "iv" in arm.settings.estimators else None
    return _UnmixedRecording(data, process, reduced, products)


def _with_progress(
    stream: Iterator[Rows], span_s: tuple[float, float], progress: Progress
) -> Iterator[Rows]:
    for rows in stream:
        yield rows
        progress((float(rows.t[-1]) - span_s[0]) / (span_s[1] - span_s[0]))


def noise(evidence: RegressionData, beta: Array) -> Array:
    """Residual rms per log and joint [N m], shape (logs, n); NaN for held joints."""
    errors = squared_error(evidence.triangles, beta).sum(axis=1)
    counts = evidence.counts.sum(axis=1)
    return np.sqrt(np.divide(errors, counts, out=np.full(errors.shape, np.nan), where=counts > 0))


def noise_weights(evidence: RegressionData) -> Array:
    """Weights 1 / sigma of each log's and joint's rows, from the OLS residual, shape (logs, n)."""
    sigma = noise(evidence, least_squares(evidence.problem().R))
    floor = 1e-6 * np.nanmax(sigma)
    return np.nan_to_num(1 / np.maximum(sigma, floor), nan=0.0)
