"""The identified arm: what `model.yaml` holds, and its inverse dynamics."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ident.dynamics.parameters import Kind, Parameter, Terms, standard_parameters
from ident.dynamics.regressor import Motion, all_columns, smooth_columns
from ident.model.arm import TERM_NAMES
from ident.model.fit_filter import Filter, smooth_motion
from ident.model.logged import Logged
from ident.model.readable_yaml import write_yaml
from ident.model.records import BaseParameter, EffectRecord, errors_content, undetermined_links
from ident.signals.arrays import Array
from wamctl.arm.errors import DataError
from wamctl.arm.inertial import INERTIAL_NAMES
from wamctl.arm.recording import Recording
from wamctl.arm.robot import Robot

FORMAT = "wam-ident model"
VERSION = 1

PER_JOINT = ("m", *(k for k in get_args(Kind) if k != "inertial"))
"""What `Model.parameter` knows."""

_ROUNDS = 50  # friction in proportion to the load: each round leaves its coefficient's share
_SETTLED = 1e-10  # rad/s^2


class ModelEffects(Protocol):
    """The effects of a model, with their equations."""

    @property
    def records(self) -> tuple[EffectRecord, ...]:
        """The effects as `model.yaml` holds them."""
        ...

    def torque(self, model: "Model", motion: Motion, period_s: float | None) -> Array:
        """Torque beside the rigid bodies and their friction [N m], shape (S, n).

        Args:
            model: the arm that has the effects.
            motion: S samples.
            period_s: between the samples, which then follow each other; None: each stands alone.
        """
        ...


class NoEffects:
    """A model without named effects."""

    @property
    def records(self) -> tuple[EffectRecord, ...]:
        """None."""
        return ()

    def torque(self, model: "Model", motion: Motion, period_s: float | None) -> Array:
        """Zeros."""
        return np.zeros_like(motion.q)


@dataclass(frozen=True)
class Model:
    """An identified arm.

    Attributes:
        arm: the arm's name.
        estimator: which one gave delta.
        robot: kinematics, frames, and gravity; its inertials are the CAD ones.
        terms: what the model holds beside the links.
        delta: standard parameters, shape (p,), in the order of `parameters`. Only their
            combinations beta are known from data; the rest follows CAD.
        moving: which joints moved in the fit, shape (n,); the model is good for motions of these.
        base_parameters: the arm's Table I.
        filter: of the fit.
        noise: error per joint on stretches that were not fitted [N m], shape (n,), or of the fit
            where that is larger; NaN for held joints.
        logs: names of the recordings of the fit.
        gains_nm_per_a: torque per ampere of each joint, where the recordings held currents; empty:
            they held torque.
        effects: effects beyond (3), as `ident gap` finds them.
        errors: of delta in the fit, shape (p, k): each column is what an independent error of size
            one does to the parameters that the base parameters are named after; k is 0 where the
            errors are not known. Infinite for parameters that stood in no row of the fit.
    """

    arm: str
    estimator: str
    robot: Robot
    terms: Terms
    delta: Array
    moving: NDArray[np.bool_]
    base_parameters: tuple[BaseParameter, ...]
    filter: Filter
    noise: Array
    logs: tuple[str, ...]
    gains_nm_per_a: tuple[float, ...] = ()
    effects: ModelEffects = field(default=NoEffects())
    errors: Array = field(default_factory=lambda: np.zeros((0, 0)), repr=False)

    def __post_init__(self) -> None:
        """Refuses parameters that do not fit the arm."""
        expected = len(standard_parameters(self.robot, self.terms))
        if np.shape(self.delta) != (expected,):
            raise DataError(
                f"The model of {self.arm} has parameters of shape {np.shape(self.delta)}; its"
                f" links and terms have {expected}."
            )

    def __repr__(self) -> str:
        """Its arm, joints, estimator and effects, without the numbers."""
        effects = [r.name for r in self.effects.records]
        parts = [f"{self.robot.dof} joints", self.estimator, *effects]
        return f"<Model {self.arm}: {', '.join(parts)}>"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Names, units, and kinds of the entries of delta."""
        return standard_parameters(self.robot, self.terms)

    def parameter(self, kind: str) -> Array:
        """Values of one kind per joint or motor, shape (n,); zero where the model has none.

        Args:
            kind: `fv`, `fc`, `fo` (joints), `ia`, `fvm`, `fcm` (motors); `m` is the links' mass.

        Raises:
            DataError: no such kind.
        """
        if kind not in PER_JOINT:
            raise DataError(
                f"There is no parameter {kind!r}; the kinds are {', '.join(PER_JOINT)}, and"
                " `inertial` holds the links'."
            )
        if kind == "m":
            return self.inertial.reshape(-1, 10)[:, 9].copy()
        values = np.zeros(self.robot.dof)
        for value, p in zip(self.delta, self.parameters, strict=True):
            if p.kind == kind:
                values[p.index - 1] = value
        return values

    @property
    def inertial(self) -> Array:
        """The links' ten parameters each, in the order of (8), shape (10 n,)."""
        return self.delta[[p.kind == "inertial" for p in self.parameters]]

    @property
    def undetermined(self) -> NDArray[np.intp]:
        """Places among the links' parameters of those that stood in no row of the fit."""
        return undetermined_links(self.parameters, self.errors)

    def inverse_dynamics(
        self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, dt: float | None = None
    ) -> Array:
        """Joint torque [N m] of links, friction and named effects, of the shape of the arguments.

        Effects with a memory (presliding, play, elasticity, delay, warm-up) follow the motion where
        `dt` is given. Without it each sample stands alone: friction long after a reversal, a spring
        that hangs by its load, no delay, a cold drive.

        Args:
            q: joint position [rad], shape (S, n) or (n,).
            qd: joint velocity [rad/s], the same shape.
            qdd: joint acceleration [rad/s^2], the same shape.
            dt: time between samples that follow each other [s]; None: each stands alone.

        Raises:
            DataError: other shapes.
        """
        motion, shape = self._motion(dt, q=q, qd=qd, qdd=qdd)
        torque = (self._regressor(motion) @ self.delta) + self.effects.torque(self, motion, dt)
        return torque.reshape(shape)

    def forward_dynamics(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike) -> Array:
        """Acceleration [rad/s^2] under a joint torque, each sample alone; shapes as the arguments.

        Args:
            q: joint position [rad], shape (S, n) or (n,).
            qd: joint velocity [rad/s], the same shape.
            tau: joint torque [N m], the same shape.

        Raises:
            DataError: other shapes.
        """
        motion, shape = self._motion(None, q=q, qd=qd, tau=tau)
        wanted, qdd = motion.qdd, np.zeros_like(motion.q)
        mass = self._mass_matrix(motion.q, motion.qd)
        for _ in range(_ROUNDS):
            left = wanted - self.inverse_dynamics(motion.q, motion.qd, qdd)
            step = np.linalg.solve(mass, left[..., None])[..., 0]
            qdd = qdd + step
            if np.abs(step).max() < _SETTLED:
                break
        return qdd.reshape(shape)

    def gravity(self, q: ArrayLike) -> Array:
        """Torque [N m] that holds the arm at rest, offsets, springs and tilts included.

        Args:
            q: joint position [rad], shape (S, n) or (n,).
        """
        rest = np.zeros_like(np.asarray(q, dtype=float))
        return self.inverse_dynamics(q, rest, rest)

    def mass_matrix(self, q: ArrayLike) -> Array:
        """Torque per acceleration at rest [kg m^2], rotors included, shape (n, n) or (S, n, n).

        Args:
            q: joint position [rad], shape (S, n) or (n,).
        """
        motion, shape = self._motion(None, q=q, qd=np.zeros_like(np.asarray(q, dtype=float)))
        return self._mass_matrix(motion.q, motion.qd).reshape(*shape, self.robot.dof)

    def friction(self, qd: ArrayLike, q: ArrayLike | None = None) -> Array:
        """Torque [N m] that the velocity adds beside the links' own, shaped as qd.

        Args:
            qd: joint velocity [rad/s], shape (S, n) or (n,).
            q: joint position [rad], the same shape, for friction that depends on the load; None: 0.
        """
        speed = np.asarray(qd, dtype=float)
        place, rest = np.zeros_like(speed) if q is None else q, np.zeros_like(speed)
        moving = self.inverse_dynamics(place, speed, rest) - self.gravity(place)
        return moving - self._links(place, speed) + self._links(place, rest)

    def regressor(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Array:
        """Torque per parameter: links and friction are `regressor(..) @ delta`.

        Args:
            q: joint position [rad], shape (S, n) or (n,).
            qd: joint velocity [rad/s], the same shape.
            qdd: joint acceleration [rad/s^2], the same shape.

        Returns:
            shape (S, n, p) or (n, p), in the order of `parameters`.
        """
        motion, shape = self._motion(None, q=q, qd=qd, qdd=qdd)
        return self._regressor(motion).reshape(*shape, len(self.delta))

    def predict(self, recording: "Recording | Logged") -> Array:
        """Torque [N m] along a recording's measured positions, shape (S, n), joints as the model's.

        Positions are smoothed and differentiated by the filter of the fit; named effects follow the
        motion.

        Raises:
            DataError: a recording of other joints, or too short to differentiate.
        """
        recording = recording.log if isinstance(recording, Logged) else recording
        names = self.robot.joint_names
        missing = [n for n in names if n not in recording.joint_names]
        if missing:
            there = ", ".join(recording.joint_names)
            raise DataError(f"The recording has no joints {', '.join(missing)}; it has {there}.")
        columns = [recording.joint_names.index(n) for n in names]
        t = (recording.stamp_ns - recording.stamp_ns[0]) * 1e-9
        even, motion = smooth_motion(t, recording.q[:, columns], self.filter)
        torque = self.inverse_dynamics(motion.q, motion.qd, motion.qdd, even[1] - even[0])
        return np.column_stack([np.interp(t, even, column) for column in torque.T])

    def save(self, path: Path | str) -> None:
        """Write the model as `model.yaml`.

        Raises:
            DataError: the file cannot be written.
        """
        write_yaml(Path(path), _content(self))

    def _motion(self, dt: float | None, **parts: ArrayLike) -> tuple[Motion, tuple[int, ...]]:
        """Two or three arrays of one shape as samples, and that shape."""
        arrays = {name: np.asarray(x, dtype=float) for name, x in parts.items()}
        shapes, n = {x.shape for x in arrays.values()}, self.robot.dof
        (shape, *others) = shapes
        if others or len(shape) not in (1, 2) or shape[-1] != n:
            given = ", ".join(f"{name} {x.shape}" for name, x in arrays.items())
            raise DataError(
                f"{self.arm} has {n} joints: give {', '.join(arrays)} of one shape, (S, {n}) or"
                f" ({n},), not {given}."
            )
        if dt is not None and not (np.isfinite(dt) and dt > 0.0 and len(shape) == 2):
            raise DataError(
                f"dt is {dt} for samples of shape {shape}: give a time above 0 s, for an array of"
                f" shape (S, {n})."
            )
        rows = [np.ascontiguousarray(x.reshape(-1, n)) for x in arrays.values()]
        return Motion(*rows, *[np.zeros_like(rows[0])] * (3 - len(rows))), shape

    def _mass_matrix(self, q: Array, qd: Array) -> Array:
        still = self.inverse_dynamics(q, qd, np.zeros_like(q))
        axes = np.eye(self.robot.dof)
        columns = [self.inverse_dynamics(q, qd, np.broadcast_to(e, q.shape)) - still for e in axes]
        return np.stack(columns, axis=-1)

    def _links(self, q: ArrayLike, qd: ArrayLike) -> Array:
        """Torque of the links alone, at constant velocity."""
        motion, shape = self._motion(None, q=q, qd=qd)
        links = [p for p in self.parameters if p.kind == "inertial"]
        columns = smooth_columns(self.robot, self.terms, motion, links)
        return (columns @ self.inertial).reshape(shape)

    def _regressor(self, motion: Motion) -> Array:
        return all_columns(self.robot, self.terms, motion, self.parameters)


def _content(model: Model) -> dict[str, Any]:
    robot, terms = model.robot, model.terms
    return {
        "format": FORMAT,
        "version": VERSION,
        "arm": model.arm,
        "estimator": model.estimator,
        "joints": list(robot.joint_names),
        "moving": [bool(m) for m in model.moving],
        "noise_nm": [None if np.isnan(x) else float(x) for x in model.noise],
        "gravity_m_s2": [float(g) for g in robot.model.gravity.linear],
        "parameter_frames": list(robot.parameter_frames),
        "terms": [name for name in TERM_NAMES if getattr(terms, name)],
        "drive_matrix": [[float(x) for x in row] for row in terms.drive_matrix],
        "motor_friction": terms.motor_friction,
        "links": [_link(model, k) for k in range(1, robot.dof + 1)],
        "base_parameters": [vars(b) for b in model.base_parameters],
        **errors_content(model.parameters, model.errors),
        "filter": vars(model.filter)
        | {"reversals": [[vars(part) for part in joint] for joint in model.filter.reversals]},
        "logs": list(model.logs),
        **({"gains_nm_per_a": list(model.gains_nm_per_a)} if model.gains_nm_per_a else {}),
        "effects": [e.content(robot.sliding.tolist()) for e in model.effects.records],
        "urdf": model.robot.urdf,
    }


def _link(model: Model, k: int) -> dict[str, Any]:
    values = {
        p.name: float(x) for p, x in zip(model.parameters, model.delta, strict=True) if p.index == k
    }
    return {
        "joint": model.robot.joint_names[k - 1],
        "inertia_kg_m2": {s: values[f"L{k}{s}"] for s in INERTIAL_NAMES[:6]},
        "first_moment_kg_m": {s: values[f"l{k}{s}"] for s in INERTIAL_NAMES[6:9]},
        "mass_kg": values[f"m{k}"],
        "friction": {
            p.kind: values[p.name]
            for p in model.parameters
            if p.index == k and p.kind != "inertial"
        },
    }
