"""The exported arm in MuJoCo, in closed loop along a recording's wanted motion."""

import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ident.dynamics.compiled_chain import torques
from ident.effects.simulated_model import simulation_of
from ident.identification.validation import arm_of
from ident.model.attachments import attached_config
from ident.model.identified_model import Model
from ident.recordings.loading import dataset_for
from ident.recordings.log_summary import summarise_log
from ident.signals.arrays import Array
from ident.simulation.configuration import controller_for, wire_for
from ident.simulation.loop import Controller, Wire, run
from wamctl.arm.config import ArmFile
from wamctl.arm.errors import DataError
from wamctl.arm.recording import Recording

_STEPS_PER_CYCLE = 4


@dataclass(frozen=True)
class Replay:
    """Joint positions of a recording, of MuJoCo, and of `ident simulate`.

    Attributes:
        name: of the recording.
        joints: names.
        t: time [s], shape (S,).
        measured, mujoco, own: [rad], each of shape (S, n).
    """

    name: str
    joints: tuple[str, ...]
    t: Array
    measured: Array
    mujoco: Array
    own: Array


def rms_of(replays: Sequence[Replay]) -> dict[str, list[float]]:
    """Rms joint error of both simulations against all recordings [rad], joint by joint."""
    left = {
        "mujoco": [r.measured - r.mujoco for r in replays],
        "own": [r.measured - r.own for r in replays],
    }
    return {
        name: np.sqrt(np.mean(np.concatenate(parts) ** 2, axis=0)).tolist()
        for name, parts in left.items()
    }


def replay(mjcf: str, model: Model, recording: Recording, name: str) -> Replay:
    """Follow a recording's wanted motion with its controller, in MuJoCo and in the own simulation.

    The whole recording is simulated; of a log of `wamctl excite`, the counted periods are compared,
    not the test of the motors, the ramps, and the arm once its drives are disabled.

    Args:
        mjcf: the exported arm.
        model: the same.
        recording: with reference and configuration.
        name: what errors call it.

    Raises:
        DataError: a recording without these, or of other joints; MuJoCo is not installed.
    """
    file, reference = attached_config(recording, name), recording.reference
    joints = tuple(model.robot.joint_names)
    if not isinstance(file, ArmFile) or reference is None:
        raise DataError(
            f"{name} cannot be replayed: it holds no controller or no wanted motion; take a log of"
            " wamctl excite."
        )
    missing = [j for j in joints if j not in recording.joint_names]
    if missing:
        raise DataError(f"{name} has no joints {', '.join(missing)}, which the model has.")
    columns = [recording.joint_names.index(j) for j in joints]
    parts = (reference.q, reference.qd, reference.qdd)
    wanted = [np.ascontiguousarray(part[:, columns]) for part in parts]
    motion = wanted[0], wanted[1], wanted[2]
    controller, wire = controller_for(file, model.robot), wire_for(file)
    own = run(simulation_of(model), controller, wire, motion).q
    moved = _in_mujoco(mjcf, controller, wire, motion)
    counted = dataset_for(arm_of(model), summarise_log(recording, name)).segments[0].used
    span = slice(*(counted or (0, min(len(recording.q), len(own)))))
    t = (recording.stamp_ns[span] - recording.stamp_ns[0]) * 1e-9
    return Replay(name, joints, t, recording.q[span, columns], moved[span], own[span])


def _in_mujoco(
    mjcf: str, controller: Controller, wire: Wire, wanted: tuple[Array, Array, Array]
) -> Array:
    """Positions that the arm reads under computed torque, one cycle late, shape (S, n).

    Encoders and drives have the same steps as in the own simulation.
    """
    mujoco = loaded_mujoco()
    arm = mujoco.MjModel.from_xml_string(mjcf)
    arm.opt.timestep = wire.period_s / _STEPS_PER_CYCLE
    state, n = mujoco.MjData(arm), wanted[0].shape[1]
    state.qpos[:] = last = wanted[0][0]
    state.qvel[:] = velocity = wanted[1][0]
    read = np.empty_like(wanted[0])
    smoothing = 1.0 - np.exp(-2 * np.pi * controller.velocity_cutoff_hz * wire.period_s)
    torque = _law(controller, last, velocity, np.zeros(n))
    for k in np.flatnonzero(arm.actuator_delay[:n]):  # what acts first was asked for long ago
        before = np.full((arm.actuator_history[k, 0], 1), wire.given(torque)[k])
        mujoco.mj_initCtrlHistory(arm, state, k, None, before)
    for k, (q, qd, qdd) in enumerate(zip(*wanted, strict=True)):
        read[k] = wire.read(state.qpos)
        velocity = velocity + smoothing * ((read[k] - last) / wire.period_s - velocity)
        last, state.ctrl[:n] = read[k], wire.given(torque)
        correction = controller.stiffness * (q - last) + controller.damping * (qd - velocity)
        torque = _law(controller, last, velocity, qdd + correction)
        mujoco.mj_step(arm, state, nstep=_STEPS_PER_CYCLE)
    return read


def _law(controller: Controller, q: Array, qd: Array, qdd: Array) -> Array:
    return torques(controller.chain, controller.delta, q[None], qd[None], qdd[None])[0]


def loaded_mujoco() -> Any:
    """MuJoCo.

    Raises:
        DataError: it is not installed.
    """
    try:
        return importlib.import_module("mujoco")
    except ImportError as error:
        raise DataError(
            "A replay needs MuJoCo, which is not installed: pip install 'wam-ident[mujoco]'."
        ) from error
