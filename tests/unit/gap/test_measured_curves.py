"""What has no name is measured along the variable that it depends on, and predicts another motion.

The arm and its hidden torques are simulated, in forms that a curve's corners can only come near.
"""

import numpy as np
import pytest
from closed_loop import recorded, source_of, wam

from ident.gap.data.experiment import facts_of
from ident.gap.data.noise_regions import Region
from ident.gap.options import Options
from ident.gap.regression.current_model import CurrentFit, nominal_fit
from ident.gap.regression.residuals import residuals
from ident.gap.regression.rows import WindowedRows
from ident.gap.search import rows_of
from ident.planning.curves import with_curves
from ident.simulation.arm import Term, term

OPTIONS = Options()


@term
def ridges(t, q, qd, load, joint, settings, resistance, level):
    """Torque that comes again with the joint's angle, twenty times a radian."""
    resistance[joint] += settings[0] * np.sin(20.0 * q[joint])


@term
def rubbing(t, q, qd, load, joint, settings, resistance, level):
    """Friction that changes within a quarter of a radian."""
    level[joint] += settings[0] * np.sin(5.0 * q[joint])


@term
def bundle(t, q, qd, load, joint, settings, resistance, level):
    """Cables to the next joint, which that one winds up."""
    resistance[joint] += settings[0] * np.tanh(2.0 * q[joint + 1])


@term
def stirring(t, q, qd, load, joint, settings, resistance, level):
    """A fluid that both joints move."""
    resistance[joint] += settings[0] * qd[joint] * qd[joint + 1]


HIDDEN = {
    "angle": Term(ridges, 2, (0.3,)),
    "position direction": Term(rubbing, 3, (0.6,)),
    "other position": Term(bundle, 3, (0.6,)),
    "other velocity velocity": Term(stirring, 2, (0.5,)),
}


def left(current: CurrentFit, rows: WindowedRows, joint: int) -> float:
    """Mean squared residual of a joint where it slides [N^2 m^2]."""
    found = residuals(current.design(rows), current.fit)[joint]
    return float(np.mean(found.values[found.region == Region.SLIDING] ** 2))


@pytest.mark.parametrize("variant", HIDDEN)
def test_a_torque_without_a_name_is_measured_along_its_variable(variant):
    hidden = HIDDEN[variant]
    arm, joint = wam(hidden), hidden.joint
    first, slower = (source_of(recorded(arm, slower=x)) for x in (1.0, 1.5))
    rows, unseen = rows_of(first, OPTIONS), rows_of(slower, OPTIONS)
    nominal = nominal_fit(rows, facts_of(first))
    found = with_curves(rows, nominal, joint, OPTIONS.settings)
    assert found is not None
    assert found.accepted[0].variant == variant
    assert {h.rows for h in found.accepted} == {(joint,)}
    assert variant == "other position" or len(found.accepted) == 1
    assert left(found, unseen, joint) < 0.15 * left(nominal, unseen, joint)
