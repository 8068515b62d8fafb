"""Offsets that the model of a search holds beside what is named are told, with their errors."""

import numpy as np
import pytest
from chain_arm import Experiment

from ident.gap.data.experiment import of_arm
from ident.gap.options import Options
from ident.workflows.gap import gap_of


def searched(offsets):
    log = Experiment(joints=4, seconds=30.0, seed=5).log()
    rng = np.random.default_rng(2)
    tau = log.tau + np.array(offsets) + rng.normal(scale=0.2, size=log.tau.shape)
    log = log.with_(tau=tau)
    source = of_arm(log.arm(), None, [log.recording()], ["log"])
    return gap_of(source, Options(null_runs=0), lambda *told: None)


def test_what_is_named_is_no_term_and_what_is_not_has_its_size():
    found = searched([0.0, 0.1, 0.0, 2.0])
    content = found.content
    assert [(e["name"], e["joints"]) for e in content["effects"]] == [("torque_offset", [4])]
    offsets = {t["joints"][0]: t for t in content["terms"] if t["name"] == "torque_offset"}
    assert set(offsets) == {1, 2, 3}
    value = offsets[2]["parameters"]["offset"]
    assert value["unit"] == "N m"
    assert value["value"] == pytest.approx(0.1, abs=3.0 * value["sd"])
    assert value["value"] == pytest.approx(found.model.parameter("fo")[1], rel=1e-9)
    assert 0.0 < value["sd"] < 0.5


def test_a_model_without_terms_tells_none():
    content = searched([0.0, 0.0, 0.0, 0.0]).content
    assert content["effects"] == content["terms"] == []
