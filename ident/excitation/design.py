"""From an arm's file to a trajectory that the arm may run."""

from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ident.dynamics.regressor import Motion
from ident.excitation.optimisation.deadline import within
from ident.excitation.optimisation.evaluate import Candidate
from ident.excitation.optimisation.multistart import Report, Task, best_design
from ident.excitation.optimisation.search import Effort, random_start
from ident.excitation.problem.arm_limits import kept_of, possible_pose
from ident.excitation.problem.closed_loop_trial import ClosedLoopTrial, nearly
from ident.excitation.problem.constraints import constraints_of
from ident.excitation.problem.criterion import Objective
from ident.excitation.problem.design_problem import Problem
from ident.excitation.problem.noise_model import Noise
from ident.excitation.problem.regressor_columns import Columns, columns_of, exact_rows, joint_terms
from ident.excitation.problem.trajectory_grid import coefficients_of, grid, series_of
from ident.excitation.settings import DesignSettings, settled
from ident.model.arm import arm_from_config
from ident.signals.arrays import Array
from ident.simulation.arm import SimulatedArm
from ident.simulation.configuration import controller_for, wire_for
from wamctl.arm.collision import collision_shapes
from wamctl.arm.config import ArmFile, LimitsSection
from wamctl.arm.errors import ConfigurationError
from wamctl.arm.robot import Robot
from wamctl.arm.trajectory import FourierSeries, Trajectory, reference, sample
from wamctl.arm.trajectory_check import (
    Quantity,
    bounded,
    expected_friction,
    quantities,
    violations,
)

_SEARCH_SAMPLES = 128
_JUDGED_SAMPLES = 1000
_PROMISE_SAMPLES = 2000
_BLIND = 1e8
_CHECK_S = 0.001
_HAIR = 1e-9
_SHRINK = (
    1.0,
    0.999,
    0.995,
    0.98,
    0.95,
    0.9,
    0.8,
    0.6,
    0.4,
    0.2,
    0.1,
    0.03,
    0.01,
    1e-3,
    1e-4,
    1e-5,
    1e-6,
)


@dataclass(frozen=True)
class DesignTask:
    """The arm for which a motion is designed.

    Attributes:
        arm: its configuration.
        robot: its model.
        limits: the design's bounds.
        source: what to call the configuration in messages.
        known: the arm as it was identified before; None: nothing but its file is known.
    """

    arm: ArmFile
    robot: Robot
    limits: LimitsSection
    source: Path | str
    known: SimulatedArm | None = None


@dataclass(frozen=True)
class Design:
    """A trajectory with what it asks of the arm.

    Attributes:
        trajectory: the motion, with its promise and limits.
        quantities: all that is limited, along one period at 1 kHz.
        t: times of those samples, shape (S,) [s].
        passed: sentences on limits of the arm that it passes, since it had to keep others only.
    """

    trajectory: Trajectory
    quantities: list[Quantity]
    t: Array
    passed: list[str]


def design(
    place: DesignTask, settings: DesignSettings, start: FourierSeries | None, report: Report
) -> Design:
    """The best trajectory found, which keeps every limit at 1 kHz.

    Args:
        place: the arm and the bounds.
        settings: what to minimise, how, and when to stop.
        start: a design to improve; None searches afresh.
        report: called with every better design, and with None in between.

    Raises:
        ConfigurationError: impossible limits, named; or wishes that do not fit the arm.
    """
    pose = possible_pose(place.arm, place.robot, place.limits, place.source)
    task = task_of(place, settings, start)
    return finished(place, task, pose, best_design(task, settings.processes, report))


def task_of(place: DesignTask, settings: DesignSettings, start: FourierSeries | None) -> Task:
    """What to search; its time begins now.

    Raises:
        ConfigurationError: wishes, or a start, that do not fit the arm.
    """
    excitation = place.arm.excitation
    first = None if start is None else start_of(place, start)
    problem = problem_of(place, settings)
    if problem.trial is not None:
        problem.trial.prepare()
    dense = grid(excitation.fundamental_rad_s, excitation.harmonics, _JUDGED_SAMPLES)
    effort = Effort(within(settings.time_s), settings.descents, settings.patience, settings.gain)
    return Task(problem, dense, effort, settings.seed, first)


def finished(place: DesignTask, task: Task, pose: Array, best: Candidate | None) -> Design:
    """The design of what a search found, or else of a random motion about an allowed pose.

    Args:
        place: the arm and the bounds.
        task: what was searched.
        pose: an allowed one, shape (n,) [rad].
        best: what was found.

    Raises:
        ConfigurationError: not even the smallest motion is allowed; the limits are named.
    """
    excitation = place.arm.excitation

    def checked(coefficients: Array) -> Design:
        series = series_of(coefficients, place.robot.joint_names, excitation.fundamental_rad_s)
        return accepted(place, task.problem.columns, series, excitation.periods)

    if best is not None:
        with suppress(ConfigurationError):
            return checked(best.coefficients)
    wild = random_start(task.problem, np.random.default_rng(task.seed))
    return checked(about(task.problem, wild, pose))


def problem_of(place: DesignTask, settings: DesignSettings) -> Problem:
    """The optimisation problem of a design.

    Raises:
        ConfigurationError: a weight for a parameter that the arm does not have.
    """
    terms = settings.terms or place.arm.identification.terms
    columns = columns_of(place.robot, joint_terms(place.robot.dof, terms))
    constraints = constraints_of(place.arm, place.robot, place.limits)
    excitation = place.arm.excitation
    samples = grid(excitation.fundamental_rad_s, excitation.harmonics, _SEARCH_SAMPLES)
    wanted, weights = settled(settings), _weights(columns, settings.weights)
    kind = wanted.objective or "errors"
    objective = Objective(kind, weights, wanted.most_condition or np.inf)
    noise = Noise.of_friction(expected_friction(place.arm)[1])
    problem = Problem(columns, objective, constraints, samples, noise)
    if place.known is None:
        return problem
    if kind not in ("errors", "balanced"):
        raise ConfigurationError(
            "--model", [f"shows standard errors, which --objective {kind} does not ask for"]
        )
    arm = arm_from_config(place.arm, place.robot, str(place.source)).with_settings(
        terms=settings.terms
    )
    trial = ClosedLoopTrial(
        arm=arm,
        controller=controller_for(place.arm, place.robot),
        wire=wire_for(place.arm),
        plants=nearly(place.known),
        weights=settings.weights,
        fundamental_rad_s=excitation.fundamental_rad_s,
        ramp_s=excitation.ramp_s,
    )
    return replace(problem, trial=trial)


def _weights(columns: Columns, wanted: dict[str, float]) -> Array:
    names = {p.name for p in columns.parameters}
    kinds = {str(p.kind) for p in columns.parameters}
    unknown = [w for w in wanted if w not in names | kinds]
    if unknown:
        valid = ", ".join(sorted(kinds)) + ", or " + ", ".join(p.name for p in columns.parameters)
        raise ConfigurationError(
            "--weight", [f"no parameter or kind {w!r}; valid are {valid}" for w in unknown]
        )
    default = [wanted.get(str(p.kind), 1.0) for p in columns.parameters]
    pairs = zip(columns.parameters, default, strict=True)
    return np.array([wanted.get(p.name, weight) for p, weight in pairs])


def start_of(place: DesignTask, start: FourierSeries) -> Array:
    """The coefficients of a design to improve, shape (2 L + 1, n).

    Raises:
        ConfigurationError: it moves other joints, or has other harmonics than the arm's file asks.
    """
    wanted = place.arm.excitation
    faults = []
    if start.joint_names != place.robot.joint_names:
        faults.append(f"it moves the joints {', '.join(start.joint_names)}")
    if start.harmonics != wanted.harmonics:
        faults.append(f"it has {start.harmonics} harmonics, not {wanted.harmonics}")
    if not np.isclose(start.fundamental_rad_s, wanted.fundamental_rad_s):
        faults.append(
            f"its fundamental is {start.fundamental_rad_s:g} rad/s, not "
            f"{wanted.fundamental_rad_s:g} rad/s"
        )
    if faults:
        raise ConfigurationError("--start", faults)
    return coefficients_of(start)


def about(problem: Problem, coefficients: Array, pose: Array) -> Array:
    """A motion moved to a pose that is allowed and made small enough to stay in range there.

    Args:
        problem: bounds and grid.
        coefficients: shape (2 L + 1, n).
        pose: shape (n,) [rad].
    """
    bounds = problem.constraints.bounds
    swing = np.abs(problem.grid.position[:, :-1] @ coefficients[:-1]).max(axis=0)
    room = bounds.kinematic[0] - np.abs(pose - bounds.middle)
    moved = coefficients.copy()
    moved[:-1] *= np.minimum(1.0, room / np.maximum(swing, np.finfo(float).tiny))
    moved[-1] = pose
    return moved


def accepted(place: DesignTask, columns: Columns, series: FourierSeries, periods: int) -> Design:
    """The motion, made smaller until Pinocchio and coal find no limit passed at 1 kHz.

    Counted periods keep the design's limits; ramps keep the arm's.

    Args:
        place: the arm and the bounds.
        columns: for the promised condition number.
        series: the motion.
        periods: how many count.

    Raises:
        ConfigurationError: not even the smallest motion is allowed; the limits are named.
    """
    arm, robot, shapes = place.arm, place.robot, collision_shapes(place.robot)
    series = _within_rates(place, series)
    faults: list[str] = []
    for factor in _SHRINK:
        smaller = replace(series, a=series.a * factor, b=series.b * factor)
        motion = reference(smaller, 1, arm.excitation.ramp_s, _CHECK_S)
        found = quantities(arm, arm.limits, robot, shapes, motion)
        counted = bounded(found, place.limits, motion.counted)
        t = motion.t[motion.counted] - motion.t[motion.counted.start]
        faults = _faults(kept_of(arm, found), motion.t) + _faults(kept_of(arm, counted), t)
        if not faults:
            promise = _promise(columns, smaller, counted)
            limits = place.limits.model_dump(mode="json")
            trajectory = Trajectory(smaller, periods, promise, limits)
            return Design(trajectory, counted, t, _faults(found, motion.t))
    raise ConfigurationError(place.source, faults)


def _within_rates(place: DesignTask, series: FourierSeries) -> FourierSeries:
    """Each joint's motion, made small enough for its rates over the ramps as well.

    In the counted periods the rates hold between the samples, too: a series falls from its peak no
    faster than the cosine of its highest harmonic does.
    """
    motion = reference(series, 1, place.arm.excitation.ramp_s, _CHECK_S)
    ramped = (motion.qd, motion.qdd, np.gradient(motion.qdd, motion.t, axis=0))
    samples = max(round(series.period_s / _CHECK_S), 4 * series.harmonics)
    g, found = grid(series.fundamental_rad_s, series.harmonics, samples), coefficients_of(series)
    between = np.cos(np.pi * series.harmonics / samples)
    steady = (d @ found / between for d in (g.velocity, g.acceleration, g.jerk))
    limited = [*zip(ramped, _rates(place.arm.limits), strict=True)]
    limited += zip(steady, _rates(place.limits), strict=True)
    uses = [np.abs(rate).max(axis=0) / np.array(bound) for rate, bound in limited]
    excess = np.max(uses, axis=0)[:, None]
    factor = np.where(excess > 1.0, (1.0 - _HAIR) / np.maximum(excess, 1.0), 1.0)
    return replace(series, a=series.a * factor, b=series.b * factor)


def _rates(limits: LimitsSection) -> tuple[tuple[float, ...], ...]:
    return limits.velocity_rad_s, limits.acceleration_rad_s2, limits.jerk_rad_s3


def _faults(found: list[Quantity], t: Array) -> list[str]:
    return [sentence for quantity in found for sentence in violations(quantity, t)]


def _promise(columns: Columns, series: FourierSeries, measured: list[Quantity]) -> dict[str, Any]:
    """What the trajectory file says of itself; no condition number where a column stays unseen."""
    t = np.linspace(0.0, series.period_s, _PROMISE_SAMPLES, endpoint=False)
    condition = float(np.linalg.cond(exact_rows(columns, Motion(*sample(series, t)))))
    promise: dict[str, Any] = {
        "condition_number": round(condition, 3) if condition < _BLIND else None,
        "parameters": len(columns.parameters),
    }
    for quantity in measured:
        if quantity.name == "distance":
            if quantity.values.size:
                promise["smallest_distance_m"] = round(float(quantity.values.min()), 4)
        elif quantity.name != "position":
            share = float(np.abs(quantity.values / quantity.upper).max())
            promise[f"largest_{quantity.name.replace(' ', '_')}_share"] = round(share, 4)
    return promise
