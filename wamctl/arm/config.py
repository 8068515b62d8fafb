"""The arm's YAML file as one frozen model: every limit stands here once, for all programs."""

from pathlib import Path

from pydantic import Field, model_validator

from wamctl.arm.drive_sections import (
    CanopenDrivesSection,
    DrivesSection,
    PuckDrivesSection,
    SafetyModuleSection,
    StopInputSection,
)
from wamctl.arm.sections import (
    BusSection,
    ControllerSection,
    ExcitationSection,
    IdentificationSection,
    LimitsSection,
    NonNegative,
    Positive,
    RobotSection,
    SafetySection,
    Section,
    SimulationSection,
    TransmissionSection,
    Vector,
)
from wamctl.arm.yaml_file import beside, find_file, read_yaml, shipped_file, validate

__all__ = [
    "ArmFile",
    "BusSection",
    "CanopenDrivesSection",
    "ControllerSection",
    "DrivesSection",
    "ExcitationSection",
    "IdentificationSection",
    "LimitsSection",
    "NonNegative",
    "Positive",
    "PuckDrivesSection",
    "RobotFile",
    "RobotSection",
    "SafetyModuleSection",
    "SafetySection",
    "Section",
    "SimulationSection",
    "StopInputSection",
    "TransmissionSection",
    "Vector",
    "beside",
    "find_file",
    "load_arm_file",
    "load_robot_file",
    "read_yaml",
    "shipped_file",
    "validate",
]


class RobotFile(Section):
    """A file that is enough for `ident`: an arm without bus and drives."""

    arm: str = Field(min_length=1, description="the arm's name")
    robot: RobotSection
    transmission: TransmissionSection | None = None
    identification: IdentificationSection = IdentificationSection()


class ArmFile(Section):
    """A file that is enough to run the experiment, and to identify the arm."""

    arm: str = Field(min_length=1, description="the arm's name, which an operator types to confirm")
    robot: RobotSection
    transmission: TransmissionSection
    identification: IdentificationSection = IdentificationSection()
    bus: BusSection
    drives: DrivesSection
    limits: LimitsSection
    controller: ControllerSection
    excitation: ExcitationSection
    safety: SafetySection
    simulation: SimulationSection | None = None

    @model_validator(mode="after")
    def _lengths_agree(self) -> "ArmFile":
        n = len(self.robot.joints)
        if n == 0:
            raise ValueError("robot.joints: name the joints, from the base outwards")
        faults = [
            f"{section}.{name}: {len(value)} entries for {n} joints"
            for section, part in self
            if isinstance(part, Section)
            for name, value in part
            if isinstance(value, tuple)
            and (section, name) not in _OTHER_LENGTHS
            and value
            and len(value) != n
        ]
        rows = self.transmission.motor_from_joint
        faults += [
            f"transmission.motor_from_joint: a row of {len(r)} entries for {n} joints"
            for r in rows
            if len(r) != n
        ]
        pairs = zip(self.limits.position_lower_rad, self.limits.position_upper_rad, strict=False)
        faults += [
            f"limits: position_lower_rad {lo:g} rad of joint {j} is not below "
            f"position_upper_rad {hi:g} rad"
            for j, (lo, hi) in enumerate(pairs, 1)
            if lo >= hi
        ]
        if faults:
            raise ValueError("; ".join(faults))
        return self


_OTHER_LENGTHS = {("robot", "gravity_m_s2"), ("identification", "terms")}


def load_arm_file(path: str | Path) -> ArmFile:
    """The configuration of an arm with bus and drives.

    Raises:
        ConfigurationError: missing or broken file, or all faults of its content at once.
    """
    found = find_file(path)
    return validate(ArmFile, read_yaml(found), found)


def load_robot_file(path: str | Path) -> RobotFile | ArmFile:
    """The configuration of an arm for identification; a file with bus and drives serves as well.

    Raises:
        ConfigurationError: as for `load_arm_file`.
    """
    found = find_file(path)
    content = read_yaml(found)
    full = isinstance(content, dict) and "drives" in content
    return validate(ArmFile if full else RobotFile, content, found)
