"""Friction on the motors' side of a differential."""

from dataclasses import replace

import numpy as np

from ident.effects.effect import Array, Coefficient, FormUncertainty, Hypothesis, Setting
from ident.effects.observation import ArmFacts, Observed
from ident.simulation.arm import SimulatedArm, Term, term

_SHARP = "sharp"


@term
def _drag(t, q, qd, load, joint, settings, resistance, level):
    other, here, there = int(settings[1]), settings[2], settings[3]
    torque = settings[0] * (here * qd[joint] + there * qd[other])
    resistance[joint] += here * torque
    resistance[other] += there * torque


class CoupledFriction:
    """tau = .. + T^T (Fm sgn(T qd) + bm T qd)."""

    id = "coupled_friction"
    title = "friction of a motor that drives two joints at once"
    equation = "tau_(i,j) += T^T (F sgn(T qd) + b T qd), T the shared motors' speed"
    source = "Guedelha et al. 2019, arXiv 1906.05070, section III"
    signature = "depends on the speeds of both joints; it turns with the motor, not with the joint"
    rivals = ("load_dependent_friction",)
    contains = ()
    experiment = "move both joints together, in all combinations of direction and of who is faster"
    compares = False
    freedom = FormUncertainty.ANY
    smooth = False
    uses = ("direction",)
    settings = (Setting("ratio", "1", (0.4, 0.63, 1.0, 1.6, 2.5), 0.4, 2.5),)

    def hypotheses(self, arm: ArmFacts) -> list[Hypothesis]:
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
                levers = {f"lever_{m + 1}{'ab'[s]}": rows[m, s] for m in motors for s in (0, 1)}
                levers |= {} if arm.knows_motors(pair) else {"ratio": 1.0}
                coulomb = [Coefficient(f"coulomb_{m + 1}", "N m", lower=0.0) for m in motors]
                viscous = [Coefficient(f"viscous_{m + 1}", "N m s/rad") for m in motors]
                for names, variant in ((coulomb, "coulomb"), (coulomb + viscous, "with drag")):
                    found.append(Hypothesis(self.id, pair, pair, tuple(names), levers, variant))
        return found

    def columns(self, seen: Observed, hypothesis: Hypothesis) -> Array:
        """Direction, and speed, of each motor, through its lever arms to the two joints."""
        pair, rows = list(hypothesis.joints), _rows(hypothesis)
        speeds = (seen.speed[:, pair] @ rows.T).T
        turning = [
            np.sign(s) if _SHARP in hypothesis.settings else seen.along(pair[0], s) for s in speeds
        ]
        columns = [np.stack(turning, axis=-1)[:, None, :] * rows.T]
        if hypothesis.variant == "with drag":
            columns.append((seen.qd[:, pair] @ rows.T)[:, None, :] * rows.T)
        return np.concatenate(columns, axis=-1)

    def bent(self, hypothesis: Hypothesis, values: Array) -> Hypothesis:
        """Motors that turn round at once: nothing says how they do."""
        return replace(hypothesis, settings={**hypothesis.settings, _SHARP: 1.0})

    def simulated(self, arm: SimulatedArm, hypothesis: Hypothesis, values: Array) -> SimulatedArm:
        """One more friction element for each motor."""
        a, b = hypothesis.joints
        rows = _rows(hypothesis)
        for m, lever in enumerate(rows):
            row = np.zeros((1, len(arm.viscous)))
            row[0, [a, b]] = lever
            arm = replace(
                arm,
                friction_rows=np.vstack([arm.friction_rows, row]),
                coulomb=np.append(arm.coulomb, values[m]),
                bristle=np.append(arm.bristle, 0.0),
            )
            if hypothesis.variant == "with drag":
                settings = (values[len(rows) + m], float(b), lever[0], lever[1])
                arm = replace(arm, terms=(*arm.terms, Term(_drag, a, settings)))
        return arm


def _rows(hypothesis: Hypothesis) -> Array:
    """Lever arms of the motors to the two joints, largest entry 1, shape (m, 2)."""
    levers = [x for name, x in hypothesis.settings.items() if name not in ("ratio", _SHARP)]
    rows = np.array(levers).reshape(-1, 2) * [1.0, hypothesis.settings.get("ratio", 1.0)]
    return rows / np.abs(rows).max(axis=1, keepdims=True)


EFFECT = CoupledFriction()
