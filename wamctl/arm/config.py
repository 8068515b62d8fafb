"""The arm's YAML file as one frozen model: every limit stands here once, for all programs."""

from pathlib import Path

from pydantic import Field, model_validator

from wamctl.arm.configuration.drive_sections import (
    CanopenDrivesSection,
    DrivesSection,
    PuckDrivesSection,
    SafetyModuleSection,
    StopInputSection,
)
from wamctl.arm.configuration.sections import (
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
    ServoSection,
    SimulationSection,
    TransmissionSection,
    Vector,
)
from wamctl.arm.configuration.yaml_file import (
    beside,
    find_file,
    read_text,
    read_yaml,
    shipped_file,
    validate,
)
from wamctl.arm.errors import ConfigurationError

__all__ = [  # of other files, and to be had here beside what this one uses or defines
    "NonNegative",
    "Positive",
    "PuckDrivesSection",
    "SafetyModuleSection",
    "StopInputSection",
    "Vector",
    "beside",
    "read_text",
    "shipped_file",
]


class RobotFile(Section):
    """A file that is enough for `ident`: an arm without bus and drives."""

    arm: str = Field(min_length=1, description="the arm's name")
    robot: RobotSection
    transmission: TransmissionSection | None = None
    identification: IdentificationSection = IdentificationSection()
    servo: ServoSection | None = None


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
            and (value or type(part).model_fields[name].default != ())
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
        faults += self._loop_faults()
        if faults:
            raise ValueError("; ".join(faults))
        return self

    def _loop_faults(self) -> list[str]:
        """Numbers that only together tell whether loop and limits can work."""
        period_s, safety, control = self.bus.period_s, self.safety, self.controller
        faults = []
        silent_s = safety.missed_cycles * period_s
        if silent_s > LONGEST_SILENCE_S:
            faults.append(
                f"safety.missed_cycles: {safety.missed_cycles} cycles of {period_s:g} s are "
                f"{silent_s:g} s, above the limit of {LONGEST_SILENCE_S:g} s without a position"
            )
        if control.velocity_cutoff_hz > 0.5 / period_s:
            faults.append(
                f"controller.velocity_cutoff_hz: {control.velocity_cutoff_hz:g} Hz is above half "
                f"of the loop's rate, {0.5 / period_s:g} Hz"
            )
        return faults + self._torque_faults()

    def _torque_faults(self) -> list[str]:
        """Torque limits that the motors of the configuration cannot have."""
        torques, drives = self.limits.motor_torque_nm, self.drives
        if isinstance(drives, CanopenDrivesSection):
            most = [MOST_OVERLOAD * rated for rated in drives.rated_torque_nm]
            why = f"{MOST_OVERLOAD:g} times the drive's rated torque"
        else:
            most = [MOST_PUCK_UNITS / units for units in drives.torque_units_per_nm]
            why = f"{MOST_PUCK_UNITS} Puck units"
        faults = [
            f"limits.motor_torque_nm: {torque:g} N m of motor {k} is above {why}, {bound:.4g} N m"
            for k, (torque, bound) in enumerate(zip(torques, most, strict=False), 1)
            if torque > bound
        ]
        watched = self.safety.unaccounted_torque_nm
        return faults + [
            f"safety.unaccounted_torque_nm: {left:g} N m of motor {k} is not below its limit of "
            f"{torque:g} N m, so that nothing would be noticed"
            for k, (left, torque) in enumerate(zip(watched, torques, strict=False), 1)
            if left >= torque
        ]


LONGEST_SILENCE_S = 0.1
"""Within this time an arm at 2 rad/s goes 0.2 rad without being seen."""
MOST_OVERLOAD = 5.0
"""Peak torque of a servo motor is three to five times its rated one."""
MOST_PUCK_UNITS = 8191
"""Largest value of a packed torque."""

_OTHER_LENGTHS = {("robot", "gravity_m_s2"), ("identification", "terms")}


def load_arm_file(path: str | Path) -> ArmFile:
    """The configuration of an arm with bus and drives.

    Raises:
        ConfigurationError: missing or broken file, or all faults of its content at once.
    """
    found = find_file(path)
    content = read_yaml(found)
    if isinstance(content, dict) and content.keys() <= RobotFile.model_fields.keys():
        needed = (name for name, field in ArmFile.model_fields.items() if field.is_required())
        absent = ", ".join(name for name in needed if name not in content)
        if absent:
            only = "is enough for `ident run`, but designs and experiments also need"
            raise ConfigurationError(found, [f"{only} {absent}, as in wam7.yaml"])
    return validate(ArmFile, content, found)


def load_robot_file(path: str | Path) -> RobotFile | ArmFile:
    """The configuration of an arm for identification; a file with bus and drives serves as well.

    Raises:
        ConfigurationError: as for `load_arm_file`.
    """
    found = find_file(path)
    content = read_yaml(found)
    full = isinstance(content, dict) and "drives" in content
    return validate(ArmFile if full else RobotFile, content, found)
