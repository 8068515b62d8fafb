"""The identified arm: what `model.yaml` holds, and its inverse dynamics."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.parameters import Parameter, Terms, standard_parameters
from ident.dynamics.regressor import SHARP, Motion, sharp_columns, smooth_columns
from wamctl.arm.robot import Robot

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Filter:
    """How the recordings of the fit were filtered, so that others can be compared with them alike.

    Attributes:
        cutoff_hz, order: the low-pass.
        differentiation_cutoff_hz: of the filter that differentiates positions.
        sign_cutoff_hz: of the velocity whose sign friction takes.
        parallel: whether torque and regressor pass the same filter.
        velocity_threshold_rad_s: slower samples were culled.
    """

    cutoff_hz: float
    order: int
    differentiation_cutoff_hz: float
    sign_cutoff_hz: float
    parallel: bool
    velocity_threshold_rad_s: float


@dataclass(frozen=True)
class BaseParameter:
    """A row of the arm's Table I.

    Attributes:
        name: the combination.
        unit: its SI unit.
        values: by estimator; CAD knows no friction.
        sd: standard error of the OLS value.
    """

    name: str
    unit: str
    values: dict[str, float]
    sd: float


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
        noise: residual of the fit per joint [N m], shape (n,); NaN for held joints.
        logs: names of the recordings of the fit.
        effects: effects beyond (3), as `ident gap` writes them.
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
    effects: tuple[dict[str, Any], ...] = field(default=())

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Names, units, and kinds of the entries of delta."""
        return standard_parameters(self.robot, self.terms)

    def parameter(self, kind: str) -> Array:
        """Values of one kind, such as `fv` or `ia`, per joint or motor, shape (n,)."""
        values = np.zeros(self.robot.dof)
        for value, p in zip(self.delta, self.parameters, strict=True):
            if p.kind == kind:
                values[p.index - 1] = value
        return values

    @property
    def inertial(self) -> Array:
        """The links' ten parameters each, in the order of (8), shape (10 n,)."""
        chosen = [p.kind == "inertial" for p in self.parameters]
        return self.delta[chosen]

    def inverse_dynamics(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Joint torque of (2) [N m], shape (S, n) or (n,), as the arguments.

        Args:
            q: joint position [rad], shape (S, n) or (n,).
            qd: joint velocity [rad/s], the same shape.
            qdd: joint acceleration [rad/s^2], the same shape.
        """
        motion = Motion(*(np.atleast_2d(np.asarray(x, dtype=float)) for x in (q, qd, qdd)))
        smooth = [i for i, p in enumerate(self.parameters) if p.kind not in SHARP]
        sharp = [i for i, p in enumerate(self.parameters) if p.kind in SHARP]
        named = self.parameters
        torque = (
            smooth_columns(self.robot, self.terms, motion, [named[i] for i in smooth])
            @ self.delta[smooth]
        )
        torque += (
            sharp_columns(self.terms, motion.qd, [named[i] for i in sharp]) @ self.delta[sharp]
        )
        return torque.reshape(np.shape(q))
