"""The arm that a recording belongs to: from the log itself, or from the file given with --robot."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ident.dynamics.parameters import Terms, unit_rows
from ident.model.attachments import HasAttachments, attached_config, attached_urdf, config_source
from wamctl.arm.config import (
    ArmFile,
    IdentificationSection,
    RobotFile,
    RobotSection,
    ServoSection,
    beside,
    find_file,
    load_robot_file,
    read_text,
    validate,
)
from wamctl.arm.errors import ConfigurationError
from wamctl.arm.robot import Robot, load_robot

TERM_NAMES = ("viscous", "coulomb", "offset", "rotor_inertia")
"""Terms that a model may hold beside the links: fields of `Terms`, and words of the settings."""


@dataclass(frozen=True)
class Arm:
    """What identification knows of an arm before it looks at the data.

    Attributes:
        name: the arm's name.
        robot: rigid-body model with the parameters of its CAD.
        settings: how its recordings are processed.
        terms: what the model holds beside the links.
        harmonic_hz: highest harmonic of the excitation [Hz], where the file says it.
        source: where all this was read.
        unrecorded: joints of a plain URDF that the recording lacks; they are locked at zero.
        servo: what its file says of position servos.
    """

    name: str
    robot: Robot
    settings: IdentificationSection
    terms: Terms
    harmonic_hz: float | None
    source: str
    unrecorded: tuple[str, ...] = ()
    servo: ServoSection = field(default_factory=ServoSection)

    def with_settings(self, **changes: Any) -> "Arm":
        """The same arm with other settings; those that are None stay.

        Raises:
            ConfigurationError: a value out of its bounds.
        """
        given = {name: value for name, value in changes.items() if value is not None}
        content = self.settings.model_dump(exclude_unset=True) | given
        settings = validate(IdentificationSection, content, "settings")
        terms = replace(self.terms, **{name: name in settings.terms for name in TERM_NAMES})
        return replace(self, settings=settings, terms=terms)


def arm_from_file(path: Path, joints: tuple[str, ...]) -> Arm:
    """The arm of a configuration or of a plain URDF.

    Args:
        path: YAML file with a `robot` section, or URDF; a bare name finds a shipped file.
        joints: joints in the recording: of a plain URDF, these are kept and the others locked.

    Raises:
        ConfigurationError: unreadable or invalid file.
    """
    found = find_file(path)
    if found.suffix in (".yaml", ".yml"):
        file = load_robot_file(found)
        urdf_path = beside(found, file.robot.urdf)
        return _arm(file, read_text(urdf_path), str(urdf_path), str(found))
    return arm_from_urdf(read_text(found), joints, str(found))


def all_joints(path: Path) -> tuple[str, ...]:
    """The joints that a robot file names, before any recording is known.

    Raises:
        ConfigurationError: unreadable or invalid file.
    """
    found = find_file(path)
    if found.suffix in (".yaml", ".yml"):
        return tuple(load_robot_file(found).robot.joints)
    return load_robot(read_text(found), source=str(found)).joint_names


def arm_from_log(carrier: HasAttachments, log: str) -> Arm:
    """The arm whose configuration and URDF travel inside the log.

    Raises:
        DataError: the log carries no URDF.
        ConfigurationError: the configuration or the URDF inside the log is invalid.
    """
    urdf, urdf_source = attached_urdf(carrier, log)
    file = attached_config(carrier, log)
    if file is None:
        return arm_from_urdf(urdf, carrier.joint_names, urdf_source)
    return _arm(file, urdf, urdf_source, config_source(log))


def arm_from_urdf(urdf: str, joints: tuple[str, ...], source: str) -> Arm:
    """The arm of a plain URDF.

    Args:
        urdf: its text.
        joints: joints in the recording: these are kept and the others locked.
        source: where the text was read.

    Raises:
        ConfigurationError: no URDF, or none of its joints is in the recording.
    """
    everything = load_robot(urdf, source=source)
    section = RobotSection(
        urdf=source, joints=tuple(n for n in everything.joint_names if n in joints)
    )
    if not section.joints:
        raise ConfigurationError(
            source,
            [
                f"none of its joints ({', '.join(everything.joint_names)}) is in the recording"
                f" ({', '.join(joints)}): give the URDF of the recorded arm (--robot), or match"
                " the names (--rename FROM=TO)"
            ],
        )
    name = everything.model.name or Path(source).stem
    arm = _arm(RobotFile(arm=name, robot=section), urdf, source, source)
    unrecorded = tuple(n for n in everything.joint_names if n not in joints)
    return replace(arm, unrecorded=unrecorded)


def _arm(file: RobotFile | ArmFile, urdf: str, urdf_source: str, source: str) -> Arm:
    robot = load_robot(
        urdf,
        file.robot.joints,
        file.robot.parameter_frames,
        file.robot.gravity_m_s2,
        urdf_source,
    )
    return arm_from_config(file, robot, source)


def arm_from_config(file: RobotFile | ArmFile, robot: Robot, source: str) -> Arm:
    """The arm of a configuration whose robot is there already.

    Raises:
        ConfigurationError: a coupling matrix that does not fit the joints.
    """
    harmonic = None
    if isinstance(file, ArmFile):
        excitation = file.excitation
        harmonic = excitation.fundamental_rad_s * excitation.harmonics / (2 * np.pi)
    terms = terms_of(file, robot.dof, file.identification.terms, source)
    servo = (file.servo if isinstance(file, RobotFile) else None) or ServoSection()
    return Arm(file.arm, robot, file.identification, terms, harmonic, source, servo=servo)


def terms_of(file: RobotFile | ArmFile, dof: int, wanted: tuple[str, ...], source: str) -> Terms:
    """The model's terms, with the coupling of motors and joints that the file states.

    Raises:
        ConfigurationError: a coupling matrix that does not fit the joints.
    """
    coupling = file.identification.friction_coupling
    matrix = coupling or (file.transmission.motor_from_joint if file.transmission else None)
    drive = np.eye(dof) if matrix is None else _square(matrix, dof, source)
    return Terms(
        **{name: name in wanted for name in TERM_NAMES},
        drive_matrix=unit_rows(drive),
        motor_friction=coupling is not None,
    )


def _square(matrix: tuple[tuple[float, ...], ...], dof: int, source: str) -> np.ndarray:
    if len(matrix) != dof or any(len(row) != dof for row in matrix):
        shape = f"{len(matrix)} rows of {len(matrix[0]) if matrix else 0} entries"
        raise ConfigurationError(
            source, [f"motor-from-joint matrix: {shape} for {dof} joints; give {dof} rows of {dof}"]
        )
    rows = np.array(matrix, dtype=float)
    if not np.any(rows, axis=1).all():
        raise ConfigurationError(source, ["motor-from-joint matrix: a row of zeros drives nothing"])
    return rows
