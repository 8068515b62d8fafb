"""The arm's YAML file as one frozen model: every limit stands here once, for all programs."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from wamctl.arm.errors import ConfigurationError

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Vector = tuple[Finite, ...]
PositiveVector = tuple[Positive, ...]
NonNegativeVector = tuple[NonNegative, ...]
PuckNode = Annotated[int, Field(ge=1, le=31)]
PuckFirmware = Annotated[int, Field(ge=32)]
PuckTorque = Annotated[int, Field(gt=0, lt=2**13)]
PuckSpeed = Annotated[float, Field(gt=0, lt=8)]
M = TypeVar("M", bound=BaseModel)


class Section(BaseModel):
    """A frozen part of the file; unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class RobotSection(Section):
    """Where the rigid-body model comes from."""

    urdf: str = Field(description="URDF file; relative paths count from this file")
    joints: tuple[str, ...] = Field(
        default=(), description="joints of the arm from the base outwards; empty: all"
    )
    parameter_frames: tuple[str, ...] = Field(
        default=(),
        description="URDF link per joint, in whose frame its parameters stand; empty: joint frames",
    )
    gravity_m_s2: tuple[Finite, Finite, Finite] = Field(
        default=(0.0, 0.0, -9.81), description="in the base frame [m/s^2]"
    )


class IdentificationSection(Section):
    """How recordings of this arm are turned into a regression."""

    cutoff_hz: Positive | None = Field(
        default=None,
        description="low-pass cut-off [Hz]; unset: 10 times the highest harmonic (paper, V-C)",
    )
    filter_order: int = Field(default=3, ge=1, le=8, description="Butterworth order (paper, V-C)")
    filter_torque: bool = Field(
        default=True, description="same filter on torque and regressor; false: paper's way"
    )
    differentiation_cutoff_hz: Positive | None = Field(
        default=None,
        description="cut-off of the filter that differentiates positions [Hz]; unset: 4 times"
        " cutoff_hz, 25 Hz at least",
    )
    sign_cutoff_hz: Positive = Field(
        default=25.0, description="cut-off of the velocity whose sign Coulomb friction takes [Hz]"
    )
    terms: tuple[Literal["viscous", "coulomb", "offset", "rotor_inertia", "auto"], ...] = Field(
        default=("viscous", "coulomb"),
        description="what the model holds beside the links, (3); auto: and what else lowers the"
        " held-out error",
    )
    feasible_set: Literal["pseudo_inertia", "paper"] = Field(
        default="pseudo_inertia",
        description="what keeps a link possible: 4x4 with triangle inequality, or the paper's (22)",
    )
    estimator: Literal["feasible", "feasible_wls", "feasible_cad", "feasible_entropic"] = Field(
        default="feasible", description="whose parameters become the model"
    )
    estimators: tuple[
        Literal["irls", "iv", "feasible_wls", "feasible_cad", "feasible_entropic"], ...
    ] = Field(default=(), description="to compare, beside cad, ols, wls, and feasible")
    total_mass_kg: Positive | None = Field(
        default=None, description="upper bound of the moving links' mass together [kg]"
    )
    center_of_mass_box_m: tuple[tuple[Vector, Vector], ...] | None = Field(
        default=None,
        description="per link the lower and the upper corner of a box in its parameter frame"
        " that holds its centre of mass [m]",
    )
    cad_spread: Positive | None = Field(
        default=None, description="masses may differ from CAD by this relative spread"
    )
    velocity_threshold_rad_s: NonNegative | Literal["auto"] = Field(
        default=0.01, description="slower samples are culled (paper, V-C) [rad/s]"
    )
    delay_s: Finite | None = Field(
        default=None,
        description="the torque of the log acts later than its stamp by this [s]; unset: only"
        " estimated and reported",
    )
    friction_coupling: tuple[Vector, ...] | None = Field(
        default=None,
        description="matrix motor from joint, when friction and rotors act on the motors' side",
    )


class TransmissionSection(Section):
    """Motor angle = A q and joint torque = A^T motor torque, with A = motor_from_joint."""

    motor_from_joint: tuple[Vector, ...] = Field(description="square matrix [rad/rad]")
    rotor_inertia_kg_m2: NonNegativeVector = Field(
        description="rotor and pinion, per motor, motor side [kg m^2]"
    )


class BusSection(Section):
    """The CAN bus."""

    channel: str = Field(description="sim, or INTERFACE:CHANNEL in python-can's words")
    bitrate_bit_s: Positive = Field(default=1_000_000, description="[bit/s]")
    data_bitrate_bit_s: Positive | None = Field(
        default=None, description="CAN FD with this bit rate for the data; unset: classic CAN"
    )
    period_s: Positive = Field(default=0.002, le=0.02, description="cycle time, SYNC to SYNC [s]")

    @property
    def is_fd(self) -> bool:
        """Whether frames are CAN FD."""
        return self.data_bitrate_bit_s is not None


class IdentitySection(Section):
    """What object 0x1018 of each drive must say."""

    vendor: int = Field(ge=0)
    product: int = Field(ge=0)


class StopInputSection(Section):
    """A switch at a drive's digital inputs (object 0x60FD) that stops the arm."""

    node_id: Annotated[int, Field(ge=1, le=127)]
    bit: Annotated[int, Field(ge=0, le=31)]
    stops_at: Literal[0, 1] = Field(
        default=0, description="level that stops; 0 also stops when a wire breaks"
    )


class CanopenDrivesSection(Section):
    """Motor controllers that speak CANopen (Puck 4), in the order of the motors."""

    protocol: Literal["canopen"]
    dictionary: str = Field(description="EDS file; relative paths count from this file")
    node_ids: tuple[Annotated[int, Field(ge=1, le=127)], ...]
    wiring: Literal["group_pdos", "pdo_per_drive"] = Field(
        description="torque frames: two shared ones, or one per drive"
    )
    counts_per_revolution: PositiveVector = Field(
        description="position counts per motor revolution"
    )
    zero_counts: tuple[int, ...] = Field(
        description="position reading of each motor at the arm's zero pose [counts]"
    )
    rated_torque_nm: PositiveVector = Field(description="0x6076 of each drive, motor side [N m]")
    sync_loss_ms: Annotated[int, Field(ge=2, le=100)] = Field(
        description="0x2406: without SYNC for this long the drive faults"
    )
    heartbeat_ms: Annotated[int, Field(ge=10, le=2000)] = Field(
        description="0x1017: heartbeat of each drive"
    )
    identity: IdentitySection
    temperature_limit_c: Positive | None = Field(
        default=None, description="of amplifier and motor [deg C]; unset: not asked for"
    )
    stop_input: StopInputSection | None = None
    home_pose_rad: Vector | None = Field(
        default=None, description="pose in which the operator zeroes the arm [rad]"
    )


class SafetyModuleSection(Section):
    """The classic WAM's safety Puck, with the limits that it polices."""

    node_id: PuckNode = 10
    firmware: PuckFirmware = Field(description="VERS that it must report")
    torque_warning_units: PuckTorque = Field(description="TL1, Puck units of any motor")
    torque_fault_units: PuckTorque = Field(description="TL2, Puck units of any motor")
    speed_warning_m_s: PuckSpeed = Field(description="VL1, at the elbow and 0.35 m beyond [m/s]")
    speed_fault_m_s: PuckSpeed = Field(description="VL2, at the elbow and 0.35 m beyond [m/s]")
    activation_s: Positive = Field(
        default=120.0, description="time for the operator to press Shift-Activate [s]"
    )


class PuckDrivesSection(Section):
    """Classic Pucks (P1, P2) and their safety module, in the order of the motors."""

    protocol: Literal["puck"]
    node_ids: tuple[PuckNode, ...]
    firmware: tuple[PuckFirmware, ...] = Field(description="VERS that each Puck must report")
    counts_per_revolution: tuple[Annotated[int, Field(gt=0)], ...] = Field(
        description="CTS that each Puck must report"
    )
    torque_units_per_nm: tuple[Annotated[int, Field(gt=0, lt=2**15)], ...] = Field(
        description="IPNM that each Puck must report, motor side [1/(N m)]"
    )
    poles: tuple[Annotated[int, Field(gt=0)], ...] = Field(
        description="POLES that each Puck must report: it tells a wrist from a gimbals hand"
    )
    joint_encoder_counts: tuple[Annotated[int, Field(ge=0)], ...] = Field(
        description="joint encoder beside each motor's own [counts per joint revolution]; 0: none"
    )
    home_pose_rad: Vector = Field(description="pose in which the operator zeroes the arm [rad]")
    temperature_limit_c: Positive | None = Field(
        default=None, description="of each Puck's board [deg C]; unset: not asked for"
    )
    safety_module: SafetyModuleSection

    @model_validator(mode="after")
    def _nodes_and_limits_agree(self) -> "PuckDrivesSection":
        module = self.safety_module
        faults = []
        if len({*self.node_ids, module.node_id}) != len(self.node_ids) + 1:
            faults.append("two Pucks, or a Puck and the safety module, share a node id")
        if len(self.node_ids) > 8:
            faults.append(f"{len(self.node_ids)} Pucks, but the two torque frames hold 8 values")
        for low, high in (
            ("torque_warning_units", "torque_fault_units"),
            ("speed_warning_m_s", "speed_fault_m_s"),
        ):
            if getattr(module, low) > getattr(module, high):
                faults.append(f"safety_module.{low} is above {high}")
        if faults:
            raise ValueError("; ".join(faults))
        return self


DrivesSection = Annotated[
    CanopenDrivesSection | PuckDrivesSection,
    Field(discriminator="protocol"),
]


class LimitsSection(Section):
    """What the arm may do: preflight, torque gate, excitation designer and report read it here."""

    position_lower_rad: Vector
    position_upper_rad: Vector
    velocity_rad_s: PositiveVector
    acceleration_rad_s2: PositiveVector
    jerk_rad_s3: PositiveVector
    motor_torque_nm: PositiveVector = Field(description="motor side, per motor [N m]")
    motor_torque_slew_nm_s: PositiveVector = Field(description="motor side, per motor [N m/s]")
    elbow_speed_m_s: Positive = Field(description="speed of the elbow point [m/s]")
    tool_speed_m_s: Positive = Field(description="speed of the tool point [m/s]")
    clearance_m: NonNegative = Field(
        default=0.0,
        description="least distance of the URDF's collision shapes that lie three joints apart [m]",
    )
    elbow_frame: str = Field(description="URDF link whose origin is the elbow point")
    tool_frame: str = Field(description="URDF link whose origin is the tool point")


class ControllerSection(Section):
    """Computed torque with the CAD model and a PD law on acceleration (paper, (47), (48))."""

    bandwidth_rad_s: PositiveVector = Field(
        description="undamped natural frequency of each joint's error [rad/s]"
    )
    damping_ratio: Positive = Field(default=1.0, description="1 is critically damped (paper, V-B)")
    velocity_cutoff_hz: Positive = Field(description="low-pass on the differentiated position [Hz]")


class ExcitationSection(Section):
    """The experiment's motion: Fourier series (46)."""

    trajectory: str | None = Field(
        default=None, description="trajectory file; relative paths count from this file"
    )
    fundamental_rad_s: Positive = Field(description="omega_f of (46) [rad/s]")
    harmonics: int = Field(ge=1, le=20, description="L of (46)")
    periods: int = Field(ge=1, description="counted periods of the steady state")
    ramp_s: Positive = Field(description="time to fade the motion in, and out again [s]")
    position_lower_rad: Vector | None = Field(
        default=None, description="tighter than the arm's limits; unset: those"
    )
    position_upper_rad: Vector | None = None
    velocity_rad_s: PositiveVector | None = None
    acceleration_rad_s2: PositiveVector | None = None
    speed_m_s: Positive | None = Field(default=None, description="of elbow and tool, likewise")
    margin: NonNegative = Field(
        default=0.1, lt=1, description="share of each limit of the arm that a design leaves free"
    )
    constraints: Literal["all", "joint_motion"] = Field(
        default="all",
        description="limits that a design keeps; joint_motion: position, velocity, acceleration "
        "and jerk alone, to compare with designs that knew no others",
    )
    expected_viscous_nm_s_rad: NonNegativeVector = Field(
        default=(), description="for the torque check, joint side [N m s/rad]; unset: none"
    )
    expected_coulomb_nm: NonNegativeVector = Field(
        default=(), description="for the torque check, joint side [N m]; unset: none"
    )


class SafetySection(Section):
    """When the experiment stops by itself."""

    tracking_error_rad: PositiveVector = Field(
        description="largest difference of reference and position, per joint [rad]"
    )
    position_margin_rad: NonNegative = Field(
        description="the arm may pass its position limits by this much [rad]"
    )
    velocity_margin: Positive = Field(
        description="the arm may move this many times as fast as its velocity limits"
    )
    missed_cycles: int = Field(
        ge=1,
        le=50,
        description="this many cycles without a drive's position, or with a late, doubled or "
        "(answers_in_order) overtaken one, more than good cycles since, stop the arm",
    )
    answers_in_order: bool = Field(
        default=False,
        description="positions come with the lowest identifier first, cycle by cycle; false: "
        "others are only counted",
    )
    braking_s: Positive = Field(description="time for a controlled stop [s]")


class SimulationSection(Section):
    """The truth of the simulated arm on `--bus sim`, which no controller reads."""

    viscous_nm_s_rad: NonNegativeVector = Field(description="joint side, per joint [N m s/rad]")
    coulomb_nm: NonNegativeVector = Field(description="joint side, per joint [N m]")
    inertia_spread: NonNegative = Field(
        le=0.5, description="links differ from the CAD model by this relative spread"
    )
    with_rotor_inertia: bool = Field(
        description="whether the rotors' inertia acts (the paper's model leaves it out)"
    )
    step_s: Positive = Field(le=0.00025, description="inner step of the physics [s]")
    braking_nm_s_rad: NonNegativeVector = Field(
        description="drag of a disabled drive's motor (phases shorted), motor side [N m s/rad]"
    )
    start_pose_rad: Vector = Field(description="where the arm rests when the drives wake up [rad]")


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


def shipped_file(name: str) -> Path:
    """Path of a file in `configs/`, from the source tree or from the installed wheel."""
    inside_wheel = Path(__file__).parent.parent / "configs" / name
    return (
        inside_wheel
        if inside_wheel.exists()
        else Path(__file__).parent.parent.parent / "configs" / name
    )


def find_file(path: str | Path) -> Path:
    """The file itself, or the shipped file of that bare name.

    Raises:
        ConfigurationError: no such file; the sentence lists the shipped ones.
    """
    path = Path(path)
    if path.is_file():
        return path
    if path.name == str(path) and shipped_file(path.name).is_file():
        return shipped_file(path.name)
    shipped = ", ".join(sorted(p.name for p in shipped_file("").glob("*.yaml")))
    raise ConfigurationError(
        path, [f"no such file, and none of that name is shipped (shipped: {shipped})"]
    )


def beside(config: Path, name: str) -> Path:
    """A path written in a configuration file: absolute, or relative to that file."""
    return (config.parent / name).resolve()


def read_yaml(path: Path) -> object:
    """The content of a YAML file.

    Raises:
        ConfigurationError: unreadable file or broken YAML, with its line.
    """
    try:
        return yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError(path, [f"cannot be read ({error})"]) from error
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f" in line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        raise ConfigurationError(
            path, [f"not valid YAML{where} ({getattr(error, 'problem', error)})"]
        ) from error


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


def validate(kind: type[M], content: object, source: Path | str) -> M:
    """The model of parsed YAML.

    Raises:
        ConfigurationError: every fault at once, each with its place in the file.
    """
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        raise ConfigurationError(
            source, [f for e in error.errors() for f in _sentences(e["loc"], e["msg"])]
        ) from error


def _sentences(place: Sequence[int | str], message: str) -> list[str]:
    text = message.removeprefix("Value error, ")
    if not place:
        return text.split("; ")
    if place[0] == "drives" and len(place) > 1:  # pydantic puts the protocol's name in between
        place = (place[0], *place[2:])
    known = {"Extra inputs are not permitted": "unknown key", "Field required": "missing"}
    where = ".".join(str(p) for p in place)
    return [f"{where}: {known.get(s, s[:1].lower() + s[1:])}" for s in text.split("; ")]
