"""The part of an arm's YAML file that says how its motor controllers are spoken to."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from wamctl.arm.configuration.sections import Positive, PositiveVector, Section, Vector

PuckNode = Annotated[int, Field(ge=1, le=31)]
PuckFirmware = Annotated[int, Field(ge=32)]
PuckTorque = Annotated[int, Field(gt=0, lt=2**13)]
PuckSpeed = Annotated[float, Field(gt=0, lt=8)]


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

    @model_validator(mode="after")
    def _shared_frames_have_identifiers(self) -> "CanopenDrivesSection":
        if self.wiring == "group_pdos" and len(self.node_ids) > 12:
            raise ValueError(
                f"{len(self.node_ids)} drives, but shared torque frames have identifiers for 12: "
                "take drives.wiring: pdo_per_drive"
            )
        return self


class SafetyModuleSection(Section):
    """The classic WAM's safety Puck, with the limits that it polices."""

    node_id: PuckNode = 10
    firmware: PuckFirmware = Field(description="VERS that it must report")
    torque_warning_units: PuckTorque = Field(description="TL1, Puck units of any motor")
    torque_fault_units: PuckTorque = Field(description="TL2, Puck units of any motor")
    speed_warning_m_s: PuckSpeed = Field(description="VL1, at the elbow and 0.35 m beyond [m/s]")
    speed_fault_m_s: PuckSpeed = Field(description="VL2, at the elbow and 0.35 m beyond [m/s]")
    activation_s: Positive = Field(
        default=120.0, le=600.0, description="time for the operator to press Shift-Activate [s]"
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
