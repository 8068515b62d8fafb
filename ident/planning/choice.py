"""Which motion tells rival answers apart soonest."""

import inspect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.dynamics.compiled_chain import chain_of
from ident.dynamics.regressor import Motion as Samples
from ident.effects.simulated_model import simulation_of
from ident.effects.smoothed_segment import DIRECTION_HZ
from ident.excitation.design import Design, DesignTask, problem_of
from ident.excitation.effect_motions import PROBES, Sketch, scattered
from ident.excitation.optimisation.scale_into_limits import fit
from ident.excitation.problem.design_problem import Problem
from ident.excitation.problem.trajectory_grid import grid, series_of
from ident.excitation.settings import DesignSettings
from ident.excitation.target_effect import drawn, frame_of
from ident.gap.data.windows import windows_for
from ident.planning.hypotheses import Hypothesis
from ident.planning.known import left_by_others, open_columns
from ident.planning.noise import in_blocks
from ident.signals.arrays import Array
from ident.simulation.configuration import controller_for, wire_for
from ident.simulation.loop import run
from wamctl.arm.trajectory import FourierSeries, reference, sample

SLOWER = 4
"""A motion runs at a quarter of its speed first."""

_RATE_HZ = 100.0
_NOISIER = 4.0  # than written down: neighbouring rows are alike, and a new motion fits less well
_ENOUGH = 12.0  # nats: more of them decide nothing more
_TELLING = 0.5  # nats: less of them tell nothing
_JOULES_PER_SECOND = 20.0  # so much energy is worth one second of motion
_OVERHEAD_S = 40.0  # of both runs: test of the motors, approach, ramps and return
_RANDOM = 4
_SAMPLES = 400

MOST_TRACKING = 0.8
"""Share of the guard's tracking error that a trial may reach."""


@dataclass(frozen=True)
class Motion:
    """A motion that might be next.

    Attributes:
        name: of the probe and its joint.
        words: what moves how.
        sketch: the motion within its limits.
        seconds: of motion that it costs, the first run at a quarter of its speed included.
        energy_j: mechanical work of the joints, both ways.
        gains: expected log-odds of the leader over each rival, were the leader right [nats].
    """

    name: str
    words: str
    sketch: Sketch
    seconds: float
    energy_j: float
    gains: Mapping[str, float]

    def worth(self, odds: Mapping[str, float]) -> float:
        """Expected gain of log-odds per second and joule [nats/s].

        Args:
            odds: of each rival.
        """
        cost = self.seconds + self.energy_j / _JOULES_PER_SECOND
        return sum(p * min(self.gains[r], _ENOUGH) for r, p in odds.items()) / cost


def motions(
    place: DesignTask, found: Sequence[Hypothesis], joints: Sequence[int], ran: Sequence[str]
) -> list[Motion]:
    """All candidates that fit into the limits, with what they are expected to show.

    Args:
        place: the arm and its limits.
        found: the answers, the leading one first.
        joints: the joints to look at, from 0.
        ran: names of motions that have run and are not repeated.
    """
    frames = {j: frame_of(place, j + 1) for j in joints}
    sketches = {f"{n}:{j + 1}": build(f) for j, f in frames.items() for n, build in PROBES.items()}
    any_frame = next(iter(frames.values()))
    sketches |= {f"scattered:{s}": scattered(any_frame, s) for s in range(_RANDOM)}
    problem = problem_of(place, DesignSettings())
    tried = ((n, within_limits(problem, s)) for n, s in sketches.items() if n not in ran)
    return [_judged(place, found, n, s) for n, s in tried if s is not None]


def distinct(found: Sequence[Hypothesis], tried: Sequence[Motion]) -> list[Hypothesis]:
    """The leader and its rivals, but for those that are the leader with more coefficients.

    An offset is a spring of any stiffness near zero: where no motion is expected to tell them
    apart, the one of fewer coefficients is the answer.
    """
    leader, *rivals = found
    told = {h.name: max(m.gains[h.name] for m in tried) for h in rivals}
    kept = [h for h in rivals if h.size <= leader.size or told[h.name] > _TELLING]
    return [leader, *kept]


def designed(place: DesignTask, motion: Motion, pose: Array) -> Design:
    """The motion, checked at 1 kHz against every limit.

    Raises:
        ConfigurationError: not even the smallest motion is allowed.
    """
    return drawn(place, motion.sketch, pose)


def within_limits(problem: Problem, sketch: Sketch) -> Sketch | None:
    """The sketch made small enough for every limit on a coarse grid; None where none is kept."""
    dense = grid(2 * np.pi / sketch.period_s, len(sketch.coefficients) // 2, _SAMPLES)
    fitted = fit(replace(problem, grid=dense), sketch.coefficients)
    return None if fitted is None else replace(sketch, coefficients=fitted)


def _judged(place: DesignTask, found: Sequence[Hypothesis], name: str, sketch: Sketch) -> Motion:
    names = place.robot.joint_names
    series = series_of(sketch.coefficients, names, 2 * np.pi / sketch.period_s)
    leader, rivals = found[0], found[1:]
    gains = {h.name: 0.0 for h in rivals}
    energy = 0.0
    windows = windows_for(_RATE_HZ, leader.noise.cutoff_hz)
    for each in (slowed(series), series):
        torque, motion = torques_along(found, each)
        qd = motion[1]
        noise = leader.noise.of_rows(qd, windows)
        turns = np.sign(qd), np.stack([qd] * len(DIRECTION_HZ))
        own = open_columns(chain_of(place.robot), leader.known, motion, turns, windows)
        known = leader.known.products[: own.shape[2], : own.shape[2]]
        for h in rivals:
            apart = windows.mean(torque[leader.name] - torque[h.name])
            told = in_blocks(apart / noise * left_by_others(apart, own, known, noise), windows)
            gains[h.name] += expected_growth(told.sum(axis=1))
        energy += float(np.abs(torque[leader.name] * qd).sum() / _RATE_HZ)
    seconds = (1 + SLOWER) * series.period_s + _OVERHEAD_S
    return Motion(name, _words(name), sketch, seconds, energy, gains)


def _words(name: str) -> str:
    """The first line of a probe's docstring, with its joint."""
    probe, _, number = name.partition(":")
    build = PROBES.get(probe)
    if build is None:
        return f"{inspect.getdoc(scattered)}"
    return f"{inspect.getdoc(build)}".replace("One joint", f"Joint {number}").replace(
        "A joint", f"Joint {number}"
    )


def slowed(series: FourierSeries) -> FourierSeries:
    """The same path at a quarter of its speed."""
    return replace(
        series,
        fundamental_rad_s=series.fundamental_rad_s / SLOWER,
        a=series.a / SLOWER,
        b=series.b / SLOWER,
    )


def torques_along(
    found: Sequence[Hypothesis], series: FourierSeries
) -> tuple[dict[str, Array], tuple[Array, Array, Array]]:
    """What each answer predicts along one period.

    The answers are models of one arm with the same terms, so that they share their columns.

    Returns:
        torque [N m] by answer, and the motion [rad, rad/s, rad/s^2], each of shape (S, n).
    """
    motion = sample(series, np.arange(0.0, series.period_s - 0.5 / _RATE_HZ, 1 / _RATE_HZ))
    columns = found[0].model.regressor(*motion)
    torque = {}
    for h in found:
        effects = h.model.effects.torque(h.model, Samples(*motion), 1 / _RATE_HZ)
        torque[h.name] = columns @ h.model.delta + effects
    return torque, motion


def expected_growth(apart: Array) -> float:
    """Expected growth of the evidence along one run [nats].

    Args:
        apart: sum of squared differences of two answers in units of the noise, of which other
            numbers make up for a part, shape (B,). A block of which they make up for more than all
            tells nothing.
    """
    nats = np.maximum(apart, 0.0) / (4.0 * _NOISIER)
    return float((np.log(2.0) - np.logaddexp(0.0, -nats)).sum())


def that_followed(place: DesignTask, found: Sequence[Hypothesis], ran: Samples) -> list[Hypothesis]:
    """The leader, and the rivals under which the arm would have followed what it has followed.

    Args:
        place: the arm, its controller, drives and guard.
        found: the answers, the leading one first.
        ran: a motion to whose end the arm has come.
    """
    shares = tracking(place, found, ran)
    return [found[0], *(h for h in found[1:] if shares[h.name] <= 1.0)]


def rehearsed(
    place: DesignTask, found: Sequence[Hypothesis], series: FourierSeries
) -> dict[str, float]:
    """The largest tracking error along one period of a motion and its ramps, see `tracking`."""
    motion = reference(series, 1, place.arm.excitation.ramp_s, place.arm.bus.period_s)
    return tracking(place, found, Samples(motion.q, motion.qd, motion.qdd))


def tracking(place: DesignTask, found: Sequence[Hypothesis], motion: Samples) -> dict[str, float]:
    """The largest tracking error along a motion in units of what the guard allows, by answer.

    Args:
        place: the arm, its controller, drives and guard.
        found: the answers.
        motion: that is to be followed, at the bus's rate.
    """
    most = np.array(place.arm.safety.tracking_error_rad)
    controller, wire = controller_for(place.arm, place.robot), wire_for(place.arm)
    shares = {}
    for h in found:
        made = run(simulation_of(h.model), controller, wire, (motion.q, motion.qd, motion.qdd))
        share = float((np.abs(made.q - motion.q).max(axis=0) / most).max())
        shares[h.name] = share if np.isfinite(share) else np.inf
    return shares
