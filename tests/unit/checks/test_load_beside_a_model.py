"""A load that a search finds beside a reference model, and what was said of it before."""

from dataclasses import replace

import numpy as np
import pytest
from chain_arm import Experiment, Log, urdf_of

from ident.checks.remark import Grade, Remark
from ident.effects.bound_effects import BoundEffects
from ident.effects.catalogue import catalogue
from ident.effects.simulated_model import with_loads
from ident.gap.data.experiment import facts_of, of_arm, with_reference_model
from ident.gap.options import Options
from ident.identification.validation import arm_of
from ident.model.identified_model import Model
from ident.workflows.gap import gap_of, without_load_doubts
from ident.workflows.run import run_data
from ident.workflows.validate import checked

JOINTS, LOAD_KG = 3, 4.0
CENTRE_M = 0.018, 0.012, 0.135  # of the last link, and of what it bears
MASSES = 5.0 * 0.7 ** np.arange(JOINTS)
HEAVY = urdf_of(JOINTS, MASSES + LOAD_KG * np.eye(JOINTS)[-1])


def known_and_loaded(told: np.ndarray) -> tuple[Model, Log]:
    """A model of the arm without a load, and a recording with one; the URDF has these masses."""
    urdf = urdf_of(JOINTS, told)
    plain = Experiment(seconds=40.0).log().with_(urdf=urdf)
    loaded = Experiment(seconds=40.0, seed=1, true_urdf=HEAVY).log().with_(urdf=urdf)
    return run_data(plain.arm(), [plain.dataset(plain.arm())]).model, loaded


def beside(known: Model, log: Log):
    return with_reference_model(of_arm(log.arm(), None, [log.recording()], ["loaded"]), known)


@pytest.mark.parametrize("empty", [slice(None), slice(1)])
def test_a_load_is_found_where_the_urdf_has_no_masses(empty):
    """It was found, and lost in the last step, which weighed it against links without mass."""
    told = MASSES.copy()
    told[empty] = 0.0
    known, log = known_and_loaded(told)
    done = gap_of(beside(known, log), Options(null_runs=0), lambda *told: None)
    assert [e["name"] for e in done.content["effects"]] == ["payload"]
    arm = arm_of(done.model)
    _, remarks = checked(with_loads(arm, done.model), [log.dataset(arm)])
    assert {r.code for r in remarks} <= {"no_inertials"}


@pytest.mark.parametrize(("factor", "stays"), [(1.0, False), (3.0, True), (1000.0, True)])
def test_a_size_of_the_torque_that_the_load_explains_is_no_unit(factor, stays):
    known, log = known_and_loaded(MASSES)
    source = beside(known, log.with_(tau=factor * log.tau))
    (point,) = catalogue()["payload"].candidates(facts_of(source))
    load = BoundEffects(((point, LOAD_KG * np.array([1.0, *CENTRE_M])),))
    units = Remark("units", (), "The torque is 3 times.", Grade.DOUBTFUL, "Check the gears.")
    other = Remark("late_torque", (), "The torque lags.", Grade.DOUBTFUL, "Set delay_s.")
    left = without_load_doubts([units, other], source, replace(known, effects=load))
    assert left == ([units, other] if stays else [other])
