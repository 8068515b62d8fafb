"""The recordings of one arm, with its configuration, controller and drives."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ident.checks.remark import Remark
from ident.dynamics.base_parameters import base_map
from ident.dynamics.compiled_chain import chain_of
from ident.dynamics.parameters import Terms
from ident.effects.observation import ArmFacts
from ident.estimation.regression_data import posture
from ident.gap.data.stretches import stretch_remarks, stretches
from ident.gap.settings import LongLogs
from ident.identification.validation import refuse_unseen
from ident.model.arm import Arm
from ident.model.attachments import attached_config, carries_urdf
from ident.model.identified_model import Model
from ident.recordings.dataset import Dataset, TorqueSource, dataset
from ident.recordings.loading import Reading, arm_of, joints_to_read
from ident.signals.arrays import Array
from ident.simulation.configuration import controller_for, wire_for
from ident.simulation.loop import Controller, Wire
from wamctl.arm.config import ArmFile, RobotFile, load_robot_file
from wamctl.arm.errors import DataError
from wamctl.arm.recording import LogFile, Recording
from wamctl.arm.robot import cad_parameters


@dataclass(frozen=True)
class Experiment:
    """Recordings with their arm.

    Attributes:
        arm: robot and settings.
        file: the arm's configuration, where one is known.
        recordings: as read.
        datasets: the same, uniform, joints in the robot's order.
        reference_model: model from earlier recordings, against which changes are searched; None:
            the links are fitted to these recordings.
        remarks: what was left out of long logs.
        is_possible: whether an arm whose friction always brakes explains the torque. Beside one
            that does not, nothing is named.
    """

    arm: Arm
    file: RobotFile | ArmFile | None
    recordings: tuple[Recording, ...]
    datasets: tuple[Dataset, ...]
    reference_model: Model | None = None
    remarks: tuple[Remark, ...] = ()
    is_possible: bool = True

    @property
    def moving(self) -> NDArray[np.bool_]:
        """Joints that move in any recording, shape (n,)."""
        return np.any([d.moving for d in self.datasets], axis=0)

    @property
    def motor_from_joint(self) -> Array | None:
        """Motor angles from joint angles, shape (n, n), or None if unknown."""
        if self.file is None or self.file.transmission is None:
            return None
        return np.array(self.file.transmission.motor_from_joint)


def read_experiment(
    paths: Sequence[Path],
    robot: Path | None = None,
    reading: Reading | None = None,
    long_logs: LongLogs | None = None,
    known: Arm | None = None,
) -> Experiment:
    """The recordings of some logs.

    Args:
        paths: the logs.
        robot: file that describes the arm; None: the one attached to the logs.
        reading: topics and torque to read.
        long_logs: how long logs are cut into stretches.
        known: the arm of logs without an attached one.

    Raises:
        DataError: a log that cannot be used, or logs of different arms.
        ConfigurationError: a robot file that cannot be used.
    """
    chosen, bounds = reading or Reading(), long_logs or LongLogs()
    topics = chosen.joint_states, chosen.joint_commands
    named = [
        part
        for p in paths
        for part in stretches(
            LogFile(p, *topics, *joints_to_read(p, robot, chosen)), len(paths), bounds
        )
    ]
    names, recordings = [n for n, _ in named], [r for _, r in named]
    if known is None or robot is not None or any(map(carries_urdf, recordings)):
        found = experiment(recordings, names, robot, chosen.torque)
    else:
        found = of_arm(known, None, recordings, names, chosen.torque)
    remarks = stretch_remarks(names, [str(p) for p in paths], bounds)
    return replace(found, remarks=remarks)


def experiment(
    recordings: Sequence[Recording],
    names: Sequence[str],
    robot: Path | None = None,
    torque: TorqueSource | None = None,
) -> Experiment:
    """Recordings of one arm, joined with it."""
    arm = arm_of(recordings, [Path(n) for n in names], robot)
    return of_arm(arm, file_of(recordings[0], names[0], robot), recordings, names, torque)


def of_arm(
    arm: Arm,
    file: RobotFile | ArmFile | None,
    recordings: Sequence[Recording],
    names: Sequence[str],
    torque: TorqueSource | None = None,
) -> Experiment:
    """Recordings of an arm that is known already.

    Args:
        arm: robot and settings.
        file: the arm's configuration, where there is one.
        recordings: as read.
        names: what to call each.
        torque: the one to use; None: the commanded one where there is one.

    Raises:
        DataError: a recording that cannot be used.
    """
    data = tuple(
        dataset(r, arm.robot.joint_names, name, torque, arm.robot.sliding.tolist())
        for r, name in zip(recordings, names, strict=True)
    )
    return Experiment(arm, file, tuple(recordings), data)


def file_of(recording: Recording, name: str, robot: Path | None) -> RobotFile | ArmFile | None:
    """The arm's configuration, as given or as attached to a log; None if there is neither.

    Raises:
        ConfigurationError: it is invalid.
    """
    if robot is not None and robot.suffix in (".yaml", ".yml"):
        return load_robot_file(robot)
    return attached_config(recording, name)


def base_columns(source: Experiment) -> NDArray[np.int64]:
    """Positions of the base inertial parameters among the links' parameters, shape (b,).

    Of a reference model's links only what its own recordings did not show is fitted again.
    """
    if source.reference_model is not None:
        return source.reference_model.undetermined
    terms = Terms(
        viscous=False,
        coulomb=False,
        offset=False,
        rotor_inertia=False,
        drive_matrix=np.eye(source.arm.robot.dof),
        motor_friction=False,
    )
    return np.array(base_map(source.arm.robot, terms, [posture(d) for d in source.datasets]).kept)


def facts_of(source: Experiment) -> ArmFacts:
    """Facts for the effects, with inertial parameters of the reference model or of the CAD."""
    reference = source.reference_model
    segments = [s for d in source.datasets for s in d.segments]
    return ArmFacts(
        chain_of(source.arm.robot),
        cad_parameters(source.arm.robot) if reference is None else reference.inertial,
        source.motor_from_joint,
        source.moving,
        np.nan_to_num(np.concatenate([s.q for s in segments]).mean(axis=0)),
        np.max([np.abs(s.tau).max(axis=0) for s in segments], axis=0),
        max(d.samples / d.rate_hz for d in source.datasets),
        reference is not None,
        all(d.torque == "commanded" for d in source.datasets),
        None if reference is None else _own_rotors(reference),
        None if reference is None else reference.parameter("fo"),
    )


def own_drives(terms: Terms) -> NDArray[np.bool_]:
    """Which motor, by row, turns with which joint alone, no other motor with it, shape (n, n)."""
    turns = terms.drive_matrix != 0.0
    return turns & (turns.sum(axis=1) == 1)[:, None] & (turns.sum(axis=0) == 1)


def _own_rotors(model: Model) -> Array:
    """Inertia of those motors' rotors at their joints [kg m^2], shape (n,)."""
    return model.parameter("ia") @ (model.terms.drive_matrix**2 * own_drives(model.terms))


def with_reference_model(
    source: Experiment, model: Model, path: str = "The reference model"
) -> Experiment:
    """The same recordings, to be compared with a reference model.

    Where the model's recordings held currents, these count as torque by the model's gains.

    Args:
        source: the recordings.
        model: the reference model.
        path: what errors call it.

    Raises:
        DataError: a model of another arm, of one some of whose joints were held, or one that holds
            effects already.
    """
    joints = source.arm.robot.joint_names
    if model.robot.joint_names != joints:
        raise DataError(
            f"{path} is a model of the joints {', '.join(model.robot.joint_names)}, but the"
            f" recordings have {', '.join(joints)}."
        )
    if model.effects.records:
        names = ", ".join(e.name for e in model.effects.records)
        raise DataError(
            f"{path} holds effects already ({names}); changes are searched against a model of"
            " ident run: give that one with --model."
        )
    for data in source.datasets:
        refuse_unseen(model, data)
    return replace(source, arm=_in_its_unit(source.arm, model), reference_model=model)


def _in_its_unit(arm: Arm, model: Model) -> Arm:
    """The arm with a model's gains, unless its own file says what its efforts are."""
    said, asked = arm.settings.model_fields_set, arm.settings
    in_nm = "torque_unit" in said and asked.torque_unit != "A"
    if not model.gains_nm_per_a or asked.gains_nm_per_a or in_nm:
        return arm
    return arm.with_settings(torque_unit="A", gains_nm_per_a=list(model.gains_nm_per_a))


def controller_of(source: Experiment) -> Controller | None:
    """The controller of the recordings, with the CAD model; None if no configuration names it."""
    if not isinstance(source.file, ArmFile):
        return None
    return controller_for(source.file, source.arm.robot)


def wire_of(source: Experiment) -> Wire | None:
    """Encoders and drives of the recordings; None if no configuration names them."""
    if not isinstance(source.file, ArmFile):
        return None
    return wire_for(source.file)
