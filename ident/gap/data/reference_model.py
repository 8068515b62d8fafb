"""Torque that a reference model predicts, to be subtracted before the search."""

from collections.abc import Callable

import numpy as np

from ident.dynamics.compiled_chain import Chain, chain_of, torques
from ident.effects.smoothed_segment import SmoothedSegment
from ident.gap.data.experiment import Experiment
from ident.model.identified_model import Model
from ident.signals.arrays import Array

PredictedTorque = Callable[[SmoothedSegment], Array]


def reference_torque(source: Experiment) -> tuple[PredictedTorque, Array] | None:
    """Torque of the reference model, and its error per joint [N m], shape (n,).

    None without a reference model. The error is the residual of the model's own fit. The joints'
    viscous and Coulomb friction are left out: they change from day to day and are fitted anew.
    """
    model = source.reference_model
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
