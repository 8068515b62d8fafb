"""A load that a search finds beside a reference model, and what was said of it before."""

import numpy as np
import pytest
from chain_arm import Experiment, Log, urdf_of

from ident.effects.simulated_model import with_loads
from ident.gap.data.experiment import of_arm, with_reference_model
from ident.gap.options import Options
from ident.identification.validation import arm_of
from ident.model.identified_model import Model
from ident.workflows.gap import gap_of
from ident.workflows.run import run_data
from ident.workflows.validate import checked

JOINTS, LOAD_KG = 3, 4.0
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
