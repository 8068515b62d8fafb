"""Friction on the motors' side of a differential."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ident.effects.candidate import Candidate, Coefficient, NonlinearParameter
from ident.effects.effect import Array, Effect, ExperimentMotion
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm, Term, term


@term
def _drag(t, q, qd, load, joint, settings, resistance, level):
    other, here, there = int(settings[1]), settings[2], settings[3]
    torque = settings[0] * (here * qd[joint] + there * qd[other])
    resistance[joint] += here * torque
    resistance[other] += there * torque


class _Motors(NamedTuple):
    """Motors that two joints share.

    Attributes:
        motors: their numbers, from 1.
        levers: their lever arms to the two joints, largest entry 1.
        ratio: of the second joint's lever arms, where it is tuned.
        sharp: whether they turn round at once.
    """

    motors: tuple[int, ...]
    levers: tuple[tuple[float, float], ...]
    ratio: float | None = None
    sharp: bool = False


class CoupledFriction(Effect[_Motors]):
    """tau = .. + T^T (Fm sgn(T qd) + bm T qd)."""

    id = "coupled_friction"
    title = "friction of a motor that drives two joints at once"
    equation = (
        "tau_(i,j) += T^T (coulomb sgn(T qd) + viscous T qd), T qd the shared motors' speeds, in"
        " which joint j counts by ratio where T is not known"
    )
    source = "Guedelha et al. 2019, arXiv 1906.05070, section III"
    signature = "depends on the speeds of both joints; it turns with the motor, not with the joint"
    rivals = ("load_dependent_friction",)
    experiment = "move both joints together, in all combinations of direction and of who is faster"
    motion = ExperimentMotion.CHANGING_DOMINANCE
    depends_on = ("direction",)
    acts_on_pairs = True
    Parameters = _Motors
    nonlinear = (NonlinearParameter("ratio", "1", (0.4, 0.63, 1.0, 1.6, 2.5), 0.4, 2.5),)

    def candidates(self, arm: ArmFacts) -> list[Candidate[_Motors]]:
        """One for each pair and choice of motors, Coulomb alone or with drag.

        Where nobody says how the motors turn with the joints, one turns with the sum of the joints
        and one with the difference, the second joint's ratio still to be tuned.
        """
        found = []
        for pair in arm.coupled_pairs:
            rows = arm.shared_motors(pair)
            choices = [(m,) for m in range(len(rows))]
            choices += [tuple(range(len(rows)))] if len(rows) > 1 else []
            for motors in choices:
                levers = tuple((float(rows[m, 0]), float(rows[m, 1])) for m in motors)
                ratio = None if arm.knows_motors(pair) else 1.0
                shape = _Motors(tuple(m + 1 for m in motors), levers, ratio)
                found += [self.at(pair, shape, variant) for variant in ("coulomb", "with drag")]
        return found

    def coefficients(self, parameters: _Motors, variant: str) -> tuple[Coefficient, ...]:
        """Coulomb friction of each motor, then viscous friction."""
        coulomb = [Coefficient(f"coulomb_{m}", "N m", lower=0.0) for m in parameters.motors]
        viscous = [Coefficient(f"viscous_{m}", "N m s/rad") for m in parameters.motors]
        return tuple(coulomb + viscous if variant == "with drag" else coulomb)

    def columns(self, seen: Observed, candidate: Candidate[_Motors]) -> Array:
        """Direction, and speed, of each motor, through its lever arms to the two joints."""
        pair, rows = list(candidate.joints), _rows(candidate)
        speeds = (seen.speed[:, pair] @ rows.T).T
        turning = [
            np.sign(s) if candidate.parameters.sharp else seen.along(pair[0], s) for s in speeds
        ]
        columns = [np.stack(turning, axis=-1)[:, None, :] * rows.T]
        if candidate.variant == "with drag":
            columns.append((seen.qd[:, pair] @ rows.T)[:, None, :] * rows.T)
        return np.concatenate(columns, axis=-1)

    def alternative_form(self, candidate: Candidate[_Motors], values: Array) -> Candidate[_Motors]:
        """Motors that turn round at once: nothing says how they do."""
        return replace(candidate, parameters=candidate.parameters._replace(sharp=True))

    def simulated(
        self, arm: SimulatedArm, candidate: Candidate[_Motors], values: Array
    ) -> SimulatedArm:
        """One more friction element for each motor."""
        a, b = candidate.joints
        rows = _rows(candidate)
        for m, lever in enumerate(rows):
            row = np.zeros((1, len(arm.viscous)))
            row[0, [a, b]] = lever
            arm = replace(
                arm,
                friction_rows=np.vstack([arm.friction_rows, row]),
                coulomb=np.append(arm.coulomb, values[m]),
                bristle=np.append(arm.bristle, 0.0),
            )
            if candidate.variant == "with drag":
                here, there, drag = float(lever[0]), float(lever[1]), float(values[len(rows) + m])
                torque = f"{drag!r} * ({here!r} * qd[{a}] + {there!r} * qd[{b}])"
                text = (a, f"{here!r} * {torque}"), (b, f"{there!r} * {torque}")
                item = Term(_drag, a, (drag, float(b), here, there), text)
                arm = arm.with_terms(item)
        return arm


def _rows(candidate: Candidate[_Motors]) -> Array:
    """Lever arms of the motors to the two joints, largest entry 1, shape (m, 2)."""
    shape = candidate.parameters
    rows = np.array(shape.levers) * [1.0, 1.0 if shape.ratio is None else shape.ratio]
    return rows / np.abs(rows).max(axis=1, keepdims=True)


EFFECT = CoupledFriction()
