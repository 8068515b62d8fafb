"""How far and how fast a held arm may go whose motors are not yet to be believed."""

import math
from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from wamctl.errors import SafetyStopError
from wamctl.experiment.loop import Arm, Array
from wamctl.safety.state_estimator import ArmState
from wamctl.telemetry.status import Phase

UNKNOWN_LOAD = 0.1
"""Share of the moving mass that a tool may have of which the model does not know: it lets the held
arm sag. A joint that goes further than such a tool would make it is not held."""
_TOOL_M = 0.1  # from the tool point to such a tool's centre of mass
_LEAST_SAG_RAD = 0.03
_MOST_SAG = 0.95  # of the tracking limit


class HoldBounds:
    """How far and how fast the joints of a held arm may go, whatever tool it carries.

    An arm that gives way to a tool is a critically damped step: x w exp(-w t) t at the distance x
    and the bandwidth w, at most x w / e. A motor with the wrong sign grows beyond that long before
    it has gone far.

    Args:
        arm: model, control law and tracking limits.
        q: where it is held, shape (n,) [rad].
        own_rad_s: speed of the motion that is wanted of it [rad/s].
        phase: in which it is held.
        sag: where the arm already is beside its reference, as it came here by motors that were
            believed, shape (n,) [rad].

    Attributes:
        furthest: from where the arm hangs, shape (n,) [rad].
        fastest: shape (n,) [rad/s].
    """

    def __init__(
        self, arm: Arm, q: Array, own_rad_s: float, phase: Phase, sag: Array | float = 0.0
    ) -> None:
        self.phase, self.sag = phase, sag
        self.furthest = sag_limit(arm, q)
        falling = self.furthest * np.sqrt(arm.control.stiffness) / math.e
        self.fastest = falling + own_rad_s

    def check(self, state: ArmState, held: Array, names: Sequence[str]) -> None:
        """Whether the arm stays within them.

        Args:
            state: of this instant.
            held: where it is held, shape (n,) [rad].
            names: of the joints.

        Raises:
            SafetyStopError: it does not.
        """
        away, speed = np.abs(state.q - held - self.sag), np.abs(state.qd)
        for value, most, did, unit in (
            (away, self.furthest, "went {:.3f} rad away", "rad"),
            (speed, self.fastest, "moved at {:.3f} rad/s", "rad/s"),
        ):
            if np.count_nonzero(value > most):
                k = int(np.argmax(value / most))
                raise SafetyStopError(
                    f"{names[k]} {did.format(value[k])} while it was held (limit {most[k]:.3f} "
                    f"{unit}): look at signs, ratios and assignment of its motors, and at the load",
                    brakes=False,
                )


def sag_limit(arm: Arm, q: Array) -> Array:
    """How far each joint may go from where it is held, shape (n,) [rad].

    Args:
        arm: model, control law and tracking limits.
        q: the pose, shape (n,) [rad].
    """
    model, data = arm.robot.model, arm.robot.data()
    tool = model.getFrameId(arm.file.limits.tool_frame)
    lever = pin.computeFrameJacobian(model, data, q, tool, pin.LOCAL_WORLD_ALIGNED)
    weight = UNKNOWN_LOAD * pin.computeTotalMass(model) * np.linalg.norm(model.gravity.linear)
    torque = weight * (np.linalg.norm(lever[:3], axis=0) + _TOOL_M)
    stiffness = np.diag(pin.crba(model, data, q)) * arm.control.stiffness
    most = _MOST_SAG * np.array(arm.file.safety.tracking_error_rad)
    return np.minimum(_LEAST_SAG_RAD + torque / stiffness, most)
