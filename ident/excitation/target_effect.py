"""Designs for what a gap needs: an effect or a gap file becomes a motion of the library."""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from ident.effects.catalogue import catalogue
from ident.effects.events import EVENTS
from ident.excitation.design import Design, DesignTask, about, accepted, problem_of
from ident.excitation.effect_motions import Frame, Sketch, motion_for
from ident.excitation.optimisation.scale_into_limits import fit
from ident.excitation.problem.arm_limits import faults_at, possible_pose, some_poses
from ident.excitation.problem.constraints import bounds_of
from ident.excitation.problem.trajectory_grid import grid, series_of
from ident.excitation.settings import DesignSettings
from ident.signals.arrays import Array
from wamctl.arm.collision import collision_shapes
from wamctl.arm.config import beside
from wamctl.arm.errors import ConfigurationError, DataError, did_you_mean, reason_of
from wamctl.arm.trajectory import read_trajectory

_SAMPLES = 1000
_REPEATS_S = 300.0
_TRIED = 60


@dataclass(frozen=True)
class Purpose:
    """What a motion is to show.

    Attributes:
        effect: name of the effect.
        joint: from 1; None leaves the choice to the library.
    """

    effect: str
    joint: int | None


def purpose_of(text: str) -> Purpose:
    """The purpose of `EFFECT`, `EFFECT:JOINT`, or of a gap file's first effect with an experiment.

    Raises:
        ConfigurationError: unknown effect, or no joint's number.
        DataError: a gap file that asks for no experiment, or is none.
    """
    if text.endswith(".json"):
        return _purpose_of_gap(Path(text))
    effect, colon, number = text.partition(":")
    known = {*catalogue(), *EVENTS}
    if effect not in known:
        valid = ", ".join(sorted(known))
        raise ConfigurationError(
            "--for", [f"no effect {effect!r}; valid are {valid}{did_you_mean(effect, known)}"]
        )
    if colon and not number.isdecimal():
        raise ConfigurationError("--for", [f"{number!r} is not the number of a joint"])
    return Purpose(effect, int(number) if colon else None)


def read_gap(path: Path, *needed: str) -> dict[str, Any]:
    """The content of a gap.json.

    Raises:
        DataError: it cannot be read, or lacks something that is needed.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if missing := set(needed) - set(content):
            raise KeyError(*missing)
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise DataError(
            f"{path} is not a gap.json that can be read ({reason_of(error)}): give what `ident gap`"
            " wrote."
        ) from error
    return content


def _purpose_of_gap(path: Path) -> Purpose:
    wanted = [e for e in read_gap(path, "effects")["effects"] if e["separating_experiment"]]
    if not wanted:
        raise DataError(f"{path} asks for no separating experiment: nothing in it is ambiguous.")
    joints = wanted[0]["joints"][:1]
    return purpose_of(":".join([wanted[0]["name"], *map(str, joints)]))


def design_motion(place: DesignTask, purpose: Purpose) -> Design:
    """The motion of the library, as large as the limits let it be.

    Raises:
        ConfigurationError: a joint that the arm does not have, or impossible limits.
    """
    found = _motion(place, purpose)
    shown = purpose.effect if purpose.joint is None else f"{purpose.effect}:{purpose.joint}"
    promise = {"shows": shown} | found.trajectory.promise
    return replace(found, trajectory=replace(found.trajectory, promise=promise))


def _motion(place: DesignTask, purpose: Purpose) -> Design:
    n = place.robot.dof
    if purpose.joint is not None and not 1 <= purpose.joint <= n:
        raise ConfigurationError("--for", [f"no joint {purpose.joint}; the arm has 1 to {n}"])
    build = motion_for(purpose.effect)
    if build is None:
        return _repeated(place)
    frame = frame_of(place, purpose.joint or 1)
    return drawn(place, build(frame), frame.pose)


def drawn(place: DesignTask, sketch: Sketch, pose: Array) -> Design:
    """A sketch, as large as the limits let it be.

    Raises:
        ConfigurationError: no motion about the pose is possible.
    """
    problem = problem_of(place, DesignSettings())
    fundamental = 2 * np.pi / sketch.period_s
    harmonics = len(sketch.coefficients) // 2
    dense = replace(problem, grid=grid(fundamental, harmonics, _SAMPLES))
    fitted = fit(dense, sketch.coefficients)
    if fitted is None:
        fitted = fit(dense, about(dense, sketch.coefficients, pose))
    if fitted is None:
        raise ConfigurationError(place.source, ["no motion about the middle pose is possible"])
    series = series_of(fitted, place.robot.joint_names, fundamental)
    return accepted(place, problem.columns, series, sketch.periods)


def _repeated(place: DesignTask) -> Design:
    """The arm's own excitation, for long enough to warm it up; what the arm may run is kept."""
    excitation = place.arm.excitation
    if excitation.trajectory is None:
        raise ConfigurationError(
            place.source,
            ["excitation.trajectory: name the motion to repeat; design one first, without --for"],
        )
    series = read_trajectory(beside(Path(place.source), excitation.trajectory)).series
    problem = problem_of(place, DesignSettings())
    unchanged = replace(place, limits=place.arm.limits)
    return accepted(unchanged, problem.columns, series, round(_REPEATS_S / series.period_s))


def frame_of(place: DesignTask, joint: int) -> Frame:
    """What the motions of a joint (from 1) are built in.

    Raises:
        ConfigurationError: no pose is allowed.
    """
    pose = possible_pose(place.arm, place.robot, place.limits, place.source)
    return Frame(
        bounds_of(place.limits),
        pose,
        _reaching_out(place, pose),
        joint - 1,
        _partner(place, joint - 1),
    )


def _partner(place: DesignTask, joint: int) -> int:
    """The joint with which a joint shares a motor, or its neighbour."""
    matrix = np.array(place.arm.transmission.motor_from_joint)
    shared = np.abs(matrix[matrix[:, joint] != 0]).sum(axis=0)
    shared[joint] = 0.0
    neighbour = joint + 1 if joint + 1 < place.robot.dof else joint - 1
    return int(shared.argmax()) if shared.any() else neighbour


def _reaching_out(place: DesignTask, pose: Array) -> Array:
    """Of some allowed poses, the one with the most first moment about the first joint's axis."""
    shapes = collision_shapes(place.robot)
    candidates = [
        p
        for p in some_poses(place.limits)[:_TRIED]
        if not faults_at(place.arm, place.robot, place.limits, shapes, p)
    ]
    return max([pose, *candidates], key=lambda p: _sideways_torque(place, p))


def _sideways_torque(place: DesignTask, pose: Array) -> float:
    """Torque that gravity would put on the first joint if the base lay on its side [N m]."""
    model = pin.Model(place.robot.model)
    torques = []
    for direction in np.eye(3):
        model.gravity.linear = 9.81 * direction
        torques.append(pin.computeGeneralizedGravity(model, model.createData(), pose)[0])
    return float(np.linalg.norm(torques))
