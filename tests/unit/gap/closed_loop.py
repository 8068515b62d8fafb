"""Recordings of a simulated WAM in closed loop, with torques that the catalogue does not know."""

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import numpy as np

from ident.dynamics.compiled_chain import chain_of
from ident.effects.candidate import Value
from ident.gap.data.blocks import blocks_of
from ident.gap.data.experiment import Experiment, base_columns, experiment, facts_of
from ident.gap.data.windows import windows_for
from ident.gap.regression.current_model import CurrentFit, nominal_fit
from ident.gap.regression.rows import WindowedRows, windowed_rows
from ident.gap.results.outcome import SearchResult
from ident.gap.selection.estimates import final_estimates
from ident.gap.settings import Significance
from ident.model.arm import arm_from_file
from ident.simulation.arm import SimulatedArm, Term, simulated_arm, term
from ident.simulation.configuration import controller_for, wire_for
from ident.simulation.loop import recorded as recording_of
from ident.simulation.loop import run
from wamctl.arm.config import load_arm_file, shipped_file
from wamctl.arm.recording import Recording
from wamctl.arm.robot import cad_parameters
from wamctl.arm.trajectory import Trajectory, read_trajectory, reference, trajectory_yaml

PERIODS = 2
ATTACHED = {
    "config.yaml": shipped_file("wam7.yaml").read_bytes(),
    "robot.urdf": shipped_file("wam7.urdf").read_bytes(),
}


@term
def sticking(t, q, qd, load, joint, settings, resistance, level):
    """Extra friction dF / cosh(qd / vs): a form that no effect of the catalogue has."""
    level[joint] += settings[0] / np.cosh(qd[joint] / settings[1])


@term
def push(t, q, qd, load, joint, settings, resistance, level):
    """Half a sine of torque on one joint, from a time on and for some seconds."""
    u = (t - settings[1]) / settings[2]
    if u > 0.0 and u < 1.0:
        resistance[joint] += settings[0] * np.sin(np.pi * u)


@term
def bump(t, q, qd, load, joint, settings, resistance, level):
    """A torque where the joint passes one place."""
    resistance[joint] += settings[0] * np.exp(-(((q[joint] - settings[1]) / settings[2]) ** 2))


@term
def cord(t, q, qd, load, joint, settings, resistance, level):
    """A cord that pulls back ever harder."""
    resistance[joint] += settings[0] * np.sinh(q[joint])


@term
def loosening(t, q, qd, load, joint, settings, resistance, level):
    """Viscous friction that falls in proportion to time."""
    resistance[joint] -= settings[0] * t / settings[1] * qd[joint]


def wam(*terms: Term) -> SimulatedArm:
    """The shipped arm, a little heavier than its CAD, with friction and further torques."""
    file = load_arm_file("wam7.yaml")
    robot = arm_from_file(Path("wam7.yaml"), ()).robot
    viscous = np.array(file.simulation.viscous_nm_s_rad)
    coulomb = np.array(file.simulation.coulomb_nm)
    heavier = 1.05 * cad_parameters(robot)
    return replace(simulated_arm(chain_of(robot), heavier, viscous, coulomb), terms=terms)


def recorded(
    arm: SimulatedArm,
    periods: int = PERIODS,
    moving: Collection[int] = range(7),
    slower: float = 1.0,
) -> Recording:
    """The arm on the shipped excitation, logged as the driver does.

    Args:
        arm: what is simulated.
        periods: of the motion.
        moving: joints (from 0) that move; the others are held. A search takes the longer the more
            there are: two or three suffice where nothing is said of the others.
        slower: how many times slower than shipped.
    """
    file = load_arm_file("wam7.yaml")
    robot = arm_from_file(Path("wam7.yaml"), ()).robot
    series = read_trajectory("wam7-excitation.yaml").series
    moves = np.isin(np.arange(len(series.a)), list(moving))[:, None]
    series = replace(series, a=series.a * moves, b=series.b * moves)
    slow = series.fundamental_rad_s / slower
    series = replace(series, fundamental_rad_s=slow, a=series.a / slower, b=series.b / slower)
    trajectory = Trajectory(series, periods, {}, {})
    motion = reference(series, periods, file.excitation.ramp_s, file.bus.period_s)
    wanted = motion.q, motion.qd, motion.qdd
    rng = np.random.default_rng(1)
    noise = 2e-3 * np.array(file.simulation.coulomb_nm) * rng.normal(size=motion.q.shape)
    result = run(arm, controller_for(file, robot), wire_for(file), wanted, noise)
    attached = {**ATTACHED, "trajectory.yaml": trajectory_yaml(trajectory).encode()}
    return recording_of(tuple(robot.joint_names), motion, result, attached, {})


def moved(arm: SimulatedArm) -> np.ndarray:
    """Positions that an arm's encoders read on one second of sine waves."""
    file = load_arm_file("wam7.yaml")
    robot = arm_from_file("wam7.yaml", ()).robot
    t = file.bus.period_s * np.arange(500)[:, None]
    w = 2 * np.pi * np.array([0.5, 0.7, 0.6, 0.8, 1.0, 1.1, 0.9])
    start = np.array([0.0, -0.6, 0.0, 1.6, 0.0, 0.0, 0.0])
    q = start + 0.2 * (1.0 - np.cos(w * t))
    wanted = (q, 0.2 * w * np.sin(w * t), 0.2 * w**2 * np.cos(w * t))
    return run(arm, controller_for(file, robot), wire_for(file), wanted).q


def estimates_of(found: SearchResult) -> tuple[dict[str, Value], ...]:
    """Values of all effects that a search accepted, with their standard errors."""
    return final_estimates(found.rows, found.end, Significance(), found.verdict.effects).parameters


def source_of(recording: Recording) -> Experiment:
    """The recording with its arm."""
    return experiment([recording], ["log.mcap"])


def nominal_of(source: Experiment) -> tuple[WindowedRows, CurrentFit]:
    """Rows of the recordings, and the nominal model fitted to them."""
    windows, facts = windows_for(source.datasets[0].rate_hz, 10.0), facts_of(source)
    rows = windowed_rows(blocks_of(source.datasets, windows), facts, base_columns(source))
    return rows, nominal_fit(rows, facts)
