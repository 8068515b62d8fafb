"""What an answer says of a recording's torque, and how much each row of it counts."""

from dataclasses import replace

import numpy as np
import pytest
from chain_arm import recorded

from ident.effects.bound_effects import bound
from ident.effects.compensation import torque_along, without_effects
from ident.gap.data.noise_regions import Region, regions
from ident.gap.data.windows import windows_for
from ident.model.records import EffectRecord
from ident.planning.noise import Noise, log_likelihood, read_noise, stretches
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


@pytest.fixture(scope="module")
def known():
    log = recorded(joints=3, seconds=20.0)
    arm = log.arm()
    data = log.dataset(arm, "log")
    return run_data(arm, [data]).model, data


def test_the_torque_of_a_model_is_that_of_the_recording_and_its_effects_are_in_it(known):
    model, data = known
    (motion,) = stretches(data)
    windows = windows_for(data.rate_hz, 10.0)
    bare = torque_along(model, data, motion)
    left, whole = windows.mean(motion.tau - bare), windows.mean(motion.tau)
    assert (np.median(np.abs(left), axis=0) < 0.01 * whole.std(axis=0)).all()
    held = replace(model, effects=bound([OFFSET]))
    (cleaned,) = without_effects(held, data).segments
    (as_it_was,) = without_effects(model, data).segments
    added = torque_along(held, data, motion) - bare
    np.testing.assert_allclose(added, as_it_was.tau - cleaned.tau, atol=1e-12)


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
    left = windows.mean(motion.tau - torque_along(answer, felt, motion))
    where = regions(motion.speeds[1], slow, None, windows)
    sigma = np.array(
        [[left[where[:, j] == r, j].std() if (where[:, j] == r).any() else 1.0 for r in Region]
         for j in range(n)]
    )  # fmt: skip

    def evidence(noise: Noise) -> float:
        ours, theirs = (log_likelihood(m, noise, felt, [motion]) for m in (answer, model))
        return signed_evidence([(ours - theirs).sum(axis=1).tolist()])

    told = Noise(sigma, slow, 10.0, None)
    alike = replace(told, sigma=np.tile(sigma[:, [Region.SLIDING]], (1, len(Region))))
    assert evidence(read_noise(told.content())) == evidence(told) > 3.5
    assert evidence(alike) < 1.5
