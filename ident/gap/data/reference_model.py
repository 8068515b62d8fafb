"""The torque of a model that was trusted before."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.compiled_chain import Chain, chain_of, torques
from ident.effects.smoothed_segment import SmoothedSegment
from ident.gap.data.experiment import Experiment
from ident.model.identified_model import Model

Array = NDArray[np.floating]
Known = Callable[[SmoothedSegment], Array]


def known_torque(source: Experiment) -> tuple[Known, Array] | None:
    """What the trusted model says of a segment, but for the joints' own friction, and its error.

    None without a trusted model. The error is the residual of the model's own fit, per joint [N m].

    The joints' viscous and Coulomb friction are fitted anew: they change from day to day.
    """
    model = source.trusted
    if model is None:
        return None
    chain = chain_of(source.arm.robot)
    return lambda segment: _torque(model, chain, segment), np.nan_to_num(model.noise)


def _torque(model: Model, chain: Chain, s: SmoothedSegment) -> Array:
    drive = model.terms.drive_matrix
    motion = (np.ascontiguousarray(a) for a in (s.q, s.qd, s.qdd))
    speed = s.qd @ drive.T
    motor = model.parameter("fvm") * speed + model.parameter("fcm") * np.sign(speed)
    motor = motor + model.parameter("ia") * (s.qdd @ drive.T)
    return torques(chain, model.inertial, *motion) + model.parameter("fo") + motor @ drive
