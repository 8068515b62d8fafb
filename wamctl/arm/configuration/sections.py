"""The parts of an arm's YAML file but its drives, as frozen models with bounds and units."""

from typing import Annotated, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Vector = tuple[Finite, ...]
PositiveVector = tuple[Positive, ...]
NonNegativeVector = tuple[NonNegative, ...]

# Bounds by physics: beyond them a number switches its check off, or is a slip of the unit.
Angle = Annotated[float, Field(ge=-100, le=100, allow_inf_nan=False)]  # [rad]; [m] where it slides
Speed = Annotated[float, Field(gt=0, le=50, allow_inf_nan=False)]  # 480 turns a minute [rad/s]
Acceleration = Annotated[float, Field(gt=0, le=2000, allow_inf_nan=False)]  # [rad/s^2]
Jerk = Annotated[float, Field(gt=0, le=1e6, allow_inf_nan=False)]  # [rad/s^3]
Torque = Annotated[float, Field(gt=0, le=1000, allow_inf_nan=False)]  # of a motor [N m]
Slew = Annotated[float, Field(gt=0, le=1e6, allow_inf_nan=False)]  # [N m/s]
PointSpeed = Annotated[float, Field(gt=0, le=10, allow_inf_nan=False)]  # of elbow and tool [m/s]
TrackingError = Annotated[float, Field(gt=0, le=1.6, allow_inf_nan=False)]  # a quarter turn [rad]


class Section(BaseModel):
    """A frozen part of the file; unknown keys are refused.

    Attributes:
        other_words: what users write for some of its keys.
    """

    other_words: ClassVar[dict[str, str]] = {}

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
        default=("viscous", "coulomb", "auto"),
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
    solver: str = Field(
        default="direct",
        description="of the feasible fit: direct (Clarabel without a modelling layer), or a"
        " solver of cvxpy for the same program, such as CLARABEL or SCS",
    )
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
    reversals: Literal["auto", "culled"] = Field(
        default="auto",
        description="how dry friction turns round; auto: along curves that the data choose, and"
        " samples near a reversal count as much as they fit; culled: at once, and only culling"
        " helps (paper, V-C), as always with filter_torque: false",
    )
    delay_s: Finite | None = Field(
        default=None,
        description="the torque of the log acts later than its stamp by this [s]; unset: only"
        " estimated and reported",
    )
    torque_unit: Literal["N m", "A"] = Field(
        default="N m",
        description="of the log's efforts; A: motor currents, whose gains are estimated from links"
        " that joints share, and from the weight in the URDF",
    )
    gains_nm_per_a: PositiveVector | None = Field(
        default=None,
        description="torque per ampere of each joint [N m/A], where it is known; unset: estimated",
    )
    friction_coupling: tuple[Vector, ...] | None = Field(
        default=None,
        description="matrix motor from joint, when friction and rotors act on the motors' side",
    )


class ServoSection(Section):
    """What is known of position servos, for identification from commands and positions."""

    encoder: Literal["link", "rotor"] = Field(
        default="link", description="on which side of the gears the position is measured"
    )
    same_servo: bool = Field(
        default=False, description="all joints have the same servo, so also the same gain and gears"
    )
    parts: tuple[str, ...] = Field(
        default=(),
        description="what may be fitted beside gain, damping, friction, rotor, and delay, such as"
        " profile, rate_gain, or half_play; empty: all that the data ask for",
    )
    fixed: dict[str, Finite | Vector] = Field(
        default={}, description="quantities that are known, one value or one a joint: not fitted"
    )
    first: dict[str, Finite | Vector] = Field(
        default={}, description="likewise, where a fit begins; parts that stand here are fitted"
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


class LimitsSection(Section):
    """What the arm may do: preflight, torque gate, excitation designer and report read it here."""

    position_lower_rad: tuple[Angle, ...]
    position_upper_rad: tuple[Angle, ...]
    velocity_rad_s: tuple[Speed, ...]
    acceleration_rad_s2: tuple[Acceleration, ...]
    jerk_rad_s3: tuple[Jerk, ...]
    motor_torque_nm: tuple[Torque, ...] = Field(description="motor side, per motor [N m]")
    motor_torque_slew_nm_s: tuple[Slew, ...] = Field(description="motor side, per motor [N m/s]")
    power_w: Positive | None = Field(
        default=None,
        le=2e4,
        description="that all motors together may put into the arm [W]; unset: any",
    )
    kinetic_energy_j: Positive | None = Field(
        default=None, le=1000.0, description="of the whole arm by the CAD model [J]; unset: any"
    )
    elbow_speed_m_s: PointSpeed = Field(description="speed of the elbow point [m/s]")
    tool_speed_m_s: PointSpeed = Field(description="speed of the tool point [m/s]")
    clearance_m: NonNegative = Field(
        default=0.0,
        le=1.0,
        description="least distance of the URDF's collision shapes that lie three joints apart [m]",
    )
    elbow_frame: str = Field(description="URDF link whose origin is the elbow point")
    tool_frame: str = Field(description="URDF link whose origin is the tool point")


class ControllerSection(Section):
    """Computed torque with the CAD model and a PD law on acceleration (paper, (47), (48))."""

    bandwidth_rad_s: PositiveVector = Field(
        description="undamped natural frequency of each joint's error [rad/s]"
    )
    damping_ratio: Positive = Field(
        default=1.0, ge=0.3, le=3.0, description="1 is critically damped (paper, V-B)"
    )
    velocity_cutoff_hz: Positive = Field(description="low-pass on the differentiated position [Hz]")


class ExcitationSection(Section):
    """The experiment's motion: Fourier series (46)."""

    trajectory: str | None = Field(
        default=None, description="trajectory file; relative paths count from this file"
    )
    fundamental_rad_s: Positive = Field(
        ge=0.02, le=100.0, description="omega_f of (46) [rad/s]; 0.02 is a period of 314 s"
    )
    harmonics: int = Field(ge=1, le=20, description="L of (46)")
    periods: int = Field(ge=1, le=1000, description="counted periods of the steady state")
    ramp_s: Positive = Field(le=30.0, description="time to fade the motion in, and out again [s]")
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
        default=(),
        description="for the torque check, and for the noise of slow motion, joint side [N m];"
        " unset: none",
    )


class SafetySection(Section):
    """When the experiment stops by itself."""

    tracking_error_rad: tuple[TrackingError, ...] = Field(
        description="largest difference of reference and position, per joint [rad]; a quarter turn"
        " at most, beyond which the control law pushes anywhere"
    )
    position_margin_rad: NonNegative = Field(
        le=0.2,
        description="the arm may pass its position limits by this much [rad]; 0.2 is what it goes"
        " while it is stopped from 4 rad/s",
    )
    velocity_margin: Positive = Field(
        ge=1.0,
        le=2.0,
        description="the arm may move this many times as fast as its velocity limits",
    )
    unaccounted_torque_nm: PositiveVector = Field(
        default=(),
        description="largest torque of each motor, motor side, that friction and what the model "
        "lacks may leave over [N m]; unset: not watched",
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
    braking_s: Positive = Field(
        le=0.5,
        description="time for a controlled stop [s]; an arm at 2 rad/s goes on for half of it",
    )


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
