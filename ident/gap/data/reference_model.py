"""Torque that a reference model predicts, to be subtracted before the search, and its errors."""

from dataclasses import dataclass

import numpy as np

from ident.dynamics.compiled_chain import Chain, chain_of, torques
from ident.dynamics.regressor import Motion, all_columns
from ident.effects.smoothed_segment import SmoothedSegment
from ident.gap.data.experiment import Experiment
from ident.model.identified_model import Model
from ident.signals.arrays import Array

_FITTED_ANEW = ("fv", "fc")


@dataclass(frozen=True)
class ReferenceTorque:
    """Torque of a reference model beside new recordings.

    The joints' viscous and Coulomb friction are left out: they change from day to day and are
    fitted anew. So are the links' parameters that its own recordings did not show.

    Attributes:
        model: the reference.
        chain: its links.
    """

    model: Model
    chain: Chain

    @property
    def noise(self) -> Array:
        """The model's error on stretches that it was not fitted to [N m], shape (n,)."""
        return np.nan_to_num(self.model.noise)

    def torque(self, s: SmoothedSegment) -> Array:
        """What the model predicts [N m], shape (S, n)."""
        model = self.model
        drive = model.terms.drive_matrix
        motion = (np.ascontiguousarray(a) for a in (s.q, s.qd, s.qdd))
        speed = s.qd @ drive.T
        motor = model.parameter("fvm") * speed + model.parameter("fcm") * np.sign(speed)
        motor = motor + model.parameter("ia") * (s.qdd @ drive.T)
        known = model.inertial
        known[model.undetermined] = 0.0
        links = torques(self.chain, known, *motion)
        return links + model.parameter("fo") + motor @ drive

    def errors(self, q: Array, qd: Array, qdd: Array) -> Array:
        """What independent errors of size one in its parameters do [N m], shape (S, n, k)."""
        model = self.model
        known = [
            i
            for i, (p, row) in enumerate(zip(model.parameters, model.errors, strict=False))
            if row.any() and np.isfinite(row).all() and p.kind not in _FITTED_ANEW
        ]
        parameters = [model.parameters[i] for i in known]
        motion = Motion(*map(np.ascontiguousarray, (q, qd, qdd)))
        return all_columns(model.robot, model.terms, motion, parameters) @ model.errors[known]


def reference_torque(source: Experiment) -> ReferenceTorque | None:
    """Torque of the reference model; None without one."""
    model = source.reference_model
    return None if model is None else ReferenceTorque(model, chain_of(source.arm.robot))
