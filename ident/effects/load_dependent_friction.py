"""Coulomb friction that grows with the torque that the transmission carries."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ident.effects.candidate import Candidate, Coefficient, NonlinearParameter
from ident.effects.effect import Array, Effect, ExperimentMotion
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm, Term, term

_TEXTS = {
    "whole load": "fabs(load[{j}])",
    "gravity load": "fabs(held[{j}])",
    "load while driving": "2.0 * fabs(load[{j}]) * step(load[{j}] * qd[{j}])",
    "load while braking": "2.0 * fabs(load[{j}]) * (1.0 - step(load[{j}] * qd[{j}]))",
    "motor torque": "fabs({less}) / (1.0 + {share!r} - 2.0 * {share!r} * step({less} * qd[{j}]))",
}
_FORMS = tuple(_TEXTS)
_ONE_WAY = _FORMS[2:4]
_LOADS = {
    "whole load": "the torque of the rigid arm",
    "gravity load": "the torque of its weight",
    "load while driving": "twice the torque of the rigid arm where it has the sign of qd_j, else 0",
    "load while braking": "twice the torque of the rigid arm where it has the sign of -qd_j, else"
    " 0",
    "motor torque": "all that the motor gives, this friction included",
}
_MOST = 0.6


@term
def _load(t, q, qd, load, joint, settings, resistance, level):
    pushing = load[joint] * qd[joint] >= 0.0
    form = settings[1]
    if form > 3.5:
        less = load[joint] + settings[2] * qd[joint] + settings[3] * np.sign(qd[joint])
        share = settings[0] if less * qd[joint] >= 0.0 else -settings[0]
        level[joint] += settings[0] * abs(less) / (1.0 - share)
    elif form < 1.5:
        level[joint] += settings[0] * abs(load[joint])
    elif pushing == (form < 2.5):
        level[joint] += 2.0 * settings[0] * abs(load[joint])


class _About(NamedTuple):
    """The coefficient about which the motor's torque is formed, which this friction adds to."""

    about: float = 0.0


class LoadDependentFriction(Effect[_About]):
    """tau = .. + mu |load| sgn(qd).

    The load is the rigid-body torque, its gravity, its driving or its braking part, or all that the
    motor gives at the joint, this friction included. In each form the coefficient is the mean of
    driving and braking: half their difference times the load is a torque gain, or a heavier link,
    and where the data leave it open so is the form, but not the mean.
    """

    id = "load_dependent_friction"
    title = "friction that grows with the load on the transmission"
    equation = "tau_j += coefficient |load_j| sgn(qd_j)"
    source = "Hamon, Gautier, Garrec 2011, eq. (6)"
    signature = "follows the direction of motion; the step at reversal grows with the load"
    rivals = ("torque_gain", "coupled_friction", "thermal_drift")
    experiment = "the same speed in poses of very different load, with and without a payload"
    motion = ExperimentMotion.LOAD_CHANGES
    linear = (Coefficient("coefficient", "1", lower=0.0, upper=_MOST),)
    linear_in_coefficients = False
    Parameters = _About
    nonlinear = (
        NonlinearParameter("about", "1", (0.0,), 0.0, _MOST, linear_grid=True, is_parameter=False),
    )
    depends_on = ("direction", "model", "friction")

    def candidates(self, arm: ArmFacts) -> list[Candidate[_About]]:
        """One for each joint and form of the load."""
        return [self.at((j,), variant=form) for j in arm.moving_joints for form in _FORMS]

    def coefficients(self, parameters: _About, variant: str) -> tuple[Coefficient, ...]:
        """The mean of driving and braking, either of which may be as large as the other.

        Raises:
            KeyError: a form of the load that is not known.
        """
        most = {form: _MOST / 2 if form in _ONE_WAY else _MOST for form in _FORMS}
        return (replace(self.linear[0], upper=most[variant]),)

    def equation_of(self, candidate: Candidate[_About]) -> str:
        """With the load that it has."""
        return f"{self.equation}, load_j {_LOADS[candidate.variant]}"

    def linearised_at(self, candidate: Candidate[_About], values: Array) -> Candidate[_About]:
        """With the motor's torque of a coefficient."""
        if candidate.variant != "motor torque":
            return candidate
        return self.moved(candidate, {"about": float(np.clip(values[0], 0.0, _MOST))})

    def alternative_form(
        self, candidate: Candidate[_About], values: Array
    ) -> Candidate[_About] | None:
        """Of friction in one direction only, the same in both."""
        one_way = candidate.variant in _ONE_WAY
        return replace(candidate, variant="whole load") if one_way else None

    def columns(self, seen: Observed, candidate: Candidate[_About]) -> Array:
        """Direction of motion times the size of the load."""
        j, form = candidate.joints[0], candidate.variant
        direction = seen.direction[:, j]
        load = seen.gravity[:, j] if form == "gravity load" else seen.load[:, j]
        if form == "motor torque":
            load = load + seen.viscous[j] * seen.qd[:, j] + seen.coulomb[j] * direction
            load = load / (1.0 - candidate.parameters.about * np.sign(load * direction))
        drives = load * direction >= 0.0
        if form in _ONE_WAY:
            load = np.where(drives == (form == _ONE_WAY[0]), 2.0 * load, 0.0)
        return (np.abs(load) * direction)[:, None, None]

    def simulated(
        self, arm: SimulatedArm, candidate: Candidate[_About], values: Array
    ) -> SimulatedArm:
        """A Coulomb level that grows with the load."""
        j, share = candidate.joints[0], float(values[0])
        viscous, coulomb = float(arm.viscous[j]), float(arm.coulomb[j])
        settings = (share, float(_FORMS.index(candidate.variant)), viscous, coulomb)
        less = f"(load[{j}] + {viscous!r} * qd[{j}] + {coulomb!r} * sgn(qd[{j}]))"
        load = _TEXTS[candidate.variant].format(j=j, less=less, share=share)
        text = f"{share!r} * {load} * sgn(qd[{j}])"
        return arm.with_terms(Term(_load, j, settings, ((j, text),)))


EFFECT = LoadDependentFriction()
