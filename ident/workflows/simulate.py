"""The work of `ident simulate`: a closed loop with an identified model, written as a log."""

import contextlib
from dataclasses import dataclass
from pathlib import Path

from ident.effects.bound_effects import checked_model, load_model
from ident.effects.simulated_model import simulation_of
from ident.model.attachments import attached_config, attached_trajectory
from ident.model.identified_model import Model
from ident.simulation.configuration import controller_for, wire_for
from ident.simulation.loop import Run, recorded, run
from wamctl.arm.config import ArmFile, beside, find_file, load_arm_file
from wamctl.arm.errors import ConfigurationError, DataError
from wamctl.arm.recorder import write_recording
from wamctl.arm.recording import Recording, read_recording
from wamctl.arm.trajectory import (
    FourierSeries,
    Reference,
    Trajectory,
    read_trajectory,
    reference,
    trajectory_yaml,
)


@dataclass(frozen=True)
class _Setting:
    """What moves the arm.

    Attributes:
        file: the arm's configuration: controller, drives, bus.
        trajectory: the motion.
        attachments: of the log that is written.
    """

    file: ArmFile
    trajectory: Trajectory
    attachments: dict[str, bytes]


def simulate_model(
    model_path: Path, trajectory: Path | None, config: str | None, out: Path
) -> Recording:
    """Simulate the arm of a `model.yaml`, and write a log.

    Args:
        model_path: the model.
        trajectory: as of `simulate`.
        config: as of `simulate`.
        out: the log.

    Raises:
        UserError: a file that cannot be used, or nothing that says how the arm is moved.
    """
    recording = simulate(load_model(model_path), trajectory, config)
    write_recording(out, recording)
    return recording


def simulate(model: Model, trajectory: Path | None = None, config: str | None = None) -> Recording:
    """Simulate the identified arm with its controller along a motion.

    Args:
        model: the arm.
        trajectory: the motion; None: the one of the recording that the model was identified on,
            or the configuration's.
        config: the arm's configuration; None: the recording's, or the shipped one of this name.

    Raises:
        UserError: a file that cannot be used, or nothing that says how the arm is moved.
    """
    setting = _setting(checked_model(model), trajectory, config)
    series = _ordered(setting.trajectory.series, model.robot.joint_names)
    file = setting.file
    motion = reference(
        series, setting.trajectory.periods, file.excitation.ramp_s, file.bus.period_s
    )
    result = run(
        simulation_of(model),
        controller_for(file, model.robot),
        wire_for(file),
        (motion.q, motion.qd, motion.qdd),
    )
    return _recording(model, setting, motion, result)


def _setting(model: Model, trajectory: Path | None, config: str | None) -> _Setting:
    """Configuration and motion: as given, else of the first recording, else the shipped ones."""
    log = _first_log(model)
    file, attachments = _file(model, log, config)
    if trajectory is not None:
        found = read_trajectory(trajectory)
    elif log is not None and (inside := attached_trajectory(log, model.logs[0])) is not None:
        found = inside.trajectory
    elif file.excitation.trajectory is not None:
        source = find_file(config or f"{model.arm}.yaml")
        found = read_trajectory(beside(source, file.excitation.trajectory))
    else:
        raise ConfigurationError(
            "--trajectory",
            [
                "not given, and neither the model's recording nor the configuration has one;"
                " ident design makes one"
            ],
        )
    motion = {"trajectory.yaml": trajectory_yaml(found).encode()}
    return _Setting(file, found, attachments | motion)


def _first_log(model: Model) -> Recording | None:
    """The recording that the model was identified on, if it is still there."""
    for name in model.logs[:1]:
        with contextlib.suppress(DataError, OSError):
            return read_recording(Path(name))
    return None


def _file(
    model: Model, log: Recording | None, config: str | None
) -> tuple[ArmFile, dict[str, bytes]]:
    if config is None and log is not None:
        file = attached_config(log, model.logs[0])
        if isinstance(file, ArmFile):
            return file, {k: v for k, v in log.attachments.items() if k == "config.yaml"}
    try:
        path = find_file(config or f"{model.arm}.yaml")
    except ConfigurationError as error:
        if config is not None:
            raise
        raise ConfigurationError(
            "--config",
            [
                f"not given, and neither the model's recording nor a shipped file says how"
                f" {model.arm} is controlled; name a file that does, such as wam7.yaml"
            ],
        ) from error
    return load_arm_file(path), {"config.yaml": path.read_bytes()}


def _ordered(series: FourierSeries, joints: tuple[str, ...]) -> FourierSeries:
    """The motion with its joints in the model's order.

    Raises:
        DataError: other joints than the model's.
    """
    if sorted(series.joint_names) != sorted(joints):
        raise DataError(
            f"The trajectory moves {', '.join(series.joint_names)}, but the model has the joints"
            f" {', '.join(joints)}."
        )
    order = [series.joint_names.index(j) for j in joints]
    return FourierSeries(
        joints, series.fundamental_rad_s, series.a[order], series.b[order], series.q0[order]
    )


def _recording(model: Model, setting: _Setting, motion: Reference, result: Run) -> Recording:
    facts = {"simulated": "ident simulate", "model": ", ".join(model.logs), "arm": model.arm}
    attachments = {**setting.attachments, "robot.urdf": model.robot.urdf.encode()}
    return recorded(tuple(model.robot.joint_names), motion, result, attachments, facts)
