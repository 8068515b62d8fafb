"""What an answer says of a recording's torque, and how much each row of it counts."""

from dataclasses import replace

import numpy as np
import pytest
from chain_arm import Experiment

from ident.effects.bound_effects import bound
from ident.effects.compensation import observed_along, without_effects
from ident.gap.data.noise_regions import Region, regions
from ident.gap.data.windows import windows_for
from ident.model.records import EffectRecord
from ident.planning.known import Known, log_likelihood, predictions, read_known
from ident.planning.noise import Noise, read_noise, stretches
from ident.recordings.dataset import in_memory
from ident.workflows.run import run_data
from wamctl.investigation.evidence import signed_evidence

OFFSET = EffectRecord(
    name="torque_offset",
    joints=(2,),
    equation="",
    variant="",
    parameters={"offset": 0.03},
    units={"offset": "N m"},
    settings={},
    rows=(2,),
)


EXACT, HARDLY = 1e9, 1.0
"""Products of columns in logs that know each number for sure, or hardly."""


def evidence(ours, theirs, noise, data, links=EXACT, effects=EXACT):
    """Of one model over another, whose numbers the logs before know so well [nats]."""
    nats = []
    for model in (ours, theirs):
        products = np.diag([links] * (30 + 3 + 3 * 10) + [effects] * len(model.effects.records))
        known = read_known(Known(np.arange(30), products).content())
        found = predictions(model, known, noise, data, stretches(data))
        windows = windows_for(data.rate_hz, noise.cutoff_hz)
        nats.append(log_likelihood(found, known, windows))
    return signed_evidence([(nats[0] - nats[1]).sum(axis=1).tolist()])


@pytest.fixture(scope="module")
def known():
    log = Experiment(joints=3, seconds=20.0).log()
    arm = log.arm()
    data = log.dataset(arm, "log")
    return run_data(arm, [data]).model, data


def test_the_torque_of_a_model_is_that_of_the_recording_and_its_effects_are_in_it(known):
    model, data = known
    (motion,) = stretches(data)
    windows = windows_for(data.rate_hz, 10.0)
    _, bare = observed_along(model, data, motion)
    left, whole = windows.mean(motion.tau - bare), windows.mean(motion.tau)
    assert (np.median(np.abs(left), axis=0) < 0.01 * whole.std(axis=0)).all()
    held = replace(model, effects=bound([OFFSET]))
    (cleaned,) = without_effects(held, data).segments
    (as_it_was,) = data.segments
    edge = (len(as_it_was.tau) - len(cleaned.tau)) // 2
    added = observed_along(held, data, motion)[1] - bare
    np.testing.assert_allclose(added, as_it_was.tau[edge:-edge] - cleaned.tau, atol=1e-12)


def test_what_is_wrong_while_a_joint_turns_back_hides_no_small_effect(known):
    model, data = known
    answer = replace(model, effects=bound([OFFSET]))
    (motion,) = stretches(data)
    windows, rng = windows_for(data.rate_hz, 10.0), np.random.default_rng(0)
    slow, n = np.full(3, 0.1), 3
    (s,) = data.segments
    turning = np.abs(np.gradient(s.q, 1 / data.rate_hz, axis=0)) < slow[0]
    noise = rng.normal(size=s.q.shape) * np.where(turning, 20.0, 1.0) * 0.1
    (shifted,) = in_memory(data, data.rate_hz, [replace(s, tau=s.tau + noise)]).segments
    tau = shifted.tau + np.array([0.0, 0.03, 0.0])
    felt = in_memory(data, data.rate_hz, [replace(s, tau=tau)])
    (motion,) = stretches(felt)
    left = windows.mean(motion.tau - observed_along(answer, felt, motion)[1])
    where = regions(motion.speeds[1], slow, None, windows)
    sigma = np.array(
        [[left[where[:, j] == r, j].std() if (where[:, j] == r).any() else 1.0 for r in Region]
         for j in range(n)]
    )  # fmt: skip

    told = Noise(sigma, slow, 10.0, None)
    alike = replace(told, sigma=np.tile(sigma[:, [Region.SLIDING]], (1, len(Region))))
    seen = evidence(answer, model, told, felt)
    assert evidence(answer, model, read_noise(told.content()), felt) == seen > 3.5
    assert evidence(answer, model, alike, felt) < 1.5


def test_a_number_that_the_logs_before_leave_open_is_no_evidence(known):
    model, data = known
    noise = Noise(np.full((3, len(Region)), 0.05), np.full(3, 0.1), 10.0, None)
    heavier = model.delta.copy()
    heavier[[p.name == "fv2" for p in model.parameters]] *= 1.5
    other = replace(model, delta=heavier)
    assert evidence(model, other, noise, data) > 5.0
    assert abs(evidence(model, other, noise, data, HARDLY)) < 1.0


def test_an_effect_counts_though_the_logs_before_leave_its_size_open(known):
    model, data = known
    noise = Noise(np.full((3, len(Region)), 0.01), np.full(3, 0.1), 10.0, None)
    (s,) = data.segments
    tau = s.tau + np.array([0.0, 0.03, 0.0])
    felt = in_memory(data, data.rate_hz, [replace(s, tau=tau)])
    half = OFFSET.model_copy(update={"parameters": {"offset": 0.015}})
    answer = replace(model, effects=bound([half]))
    fixed = evidence(answer, model, noise, felt)
    assert evidence(answer, model, noise, felt, effects=400.0) > fixed > 2.0
