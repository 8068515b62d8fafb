"""Friction that is not that of a reference model: the search fits it anew, and says so."""

import numpy as np
import pytest
from chain_arm import Experiment, Log

from ident.gap.data.experiment import of_arm, with_reference_model
from ident.gap.options import Options
from ident.workflows.gap import Gap, gap_of
from ident.workflows.run import run_data

JOINT = 2


@pytest.fixture(scope="module")
def log() -> Log:
    return Experiment(seconds=30.0).log()


def searched(log: Log, coulomb: float, viscous: float) -> Gap:
    """A search beside a log's model in the same motion, with more friction at one joint."""
    arm = log.arm()
    model = run_data(arm, [log.dataset(arm)]).model
    qd = np.gradient(log.q[:, JOINT], log.t)
    noise = np.random.default_rng(1).normal(size=log.tau.shape)
    tau = log.tau + 0.01 * np.sqrt(np.mean(log.tau**2, axis=0)) * noise
    tau[:, JOINT] += coulomb * np.sign(qd) + viscous * qd
    later = log.with_(tau=tau)
    source = with_reference_model(of_arm(later.arm(), None, [later.recording()], ["log"]), model)
    return gap_of(source, Options(null_runs=0), lambda *_: None)


@pytest.mark.parametrize(("coulomb", "viscous"), [(1.0, 0.0), (0.0, 2.0)])
def test_it_is_told_with_both_values_where_it_has_changed(log, coulomb, viscous) -> None:
    done = searched(log, coulomb, viscous)
    (told,) = done.content["friction"]
    assert told["joints"] == [JOINT + 1]
    for name, more in (("coulomb", coulomb), ("viscous", viscous)):
        found = told["parameters"][name]
        assert found["value"] - found["reference"] == pytest.approx(more, abs=0.1)
    error = told["relative_error_percent"]
    assert error["reference"] > 2 * error["value"]
    (said,) = (s for s in done.sentences if "since the reference model" in s)
    assert f"joint {JOINT + 1}" in said
    assert "{" not in said
    assert ("Coulomb" if coulomb else "viscous") + " friction is" in said
    page = done.page()
    assert "Friction since the reference model" in page
    assert "friction has changed" in page
    assert "nothing missing" not in page.lower()


def test_nothing_is_said_where_it_is_as_it_was(log) -> None:
    done = searched(log, 0.0, 0.0)
    assert "friction" not in done.content, done.content["friction"]
    assert "Friction since the reference model" not in done.page()
