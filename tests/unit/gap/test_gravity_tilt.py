"""A base that is not level, and a first joint's zero that is off."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ident.dynamics.compiled_chain import chain_of, torques
from ident.effects.catalogue import catalogue
from ident.effects.observation import ArmFacts
from wamctl.arm.robot import cad_parameters

TILT = catalogue()["gravity_tilt"]


def facts_under(source, gravity):
    """Of an arm whose gravity points along a vector; the WAM's first axis is z."""
    robot, n = source.arm.robot, source.arm.robot.dof
    chain = chain_of(robot)._replace(gravity=np.array(gravity))
    moved = (np.ones(n) > 0, np.zeros(n), 50 * np.ones(n), 60.0)
    return ArmFacts(chain, cad_parameters(robot), None, *moved)


@pytest.mark.parametrize("gravity", [(0.0, 0.0, -9.81), (0.0, 9.81, 0.0)], ids=["up", "sideways"])
def test_only_an_upright_arm_tells_a_tilt_from_its_first_zero(source, gravity):
    facts = facts_under(source, gravity)
    (h,) = TILT.candidates(facts)
    sideways = gravity[2] == 0.0
    assert ("joint 1's own axis" in TILT.assumption_of(h)) is sideways
    q = np.random.default_rng(0).normal(size=(20, facts.dof))
    rest, step = np.zeros_like(q), 1e-6
    seen: Any = SimpleNamespace(arm=facts, q=q)
    turned = q + step * np.eye(facts.dof)[0]
    zero = torques(facts.chain, facts.delta, turned, rest, rest)
    zero = (zero - torques(facts.chain, facts.delta, q, rest, rest)) / step
    tilts = TILT.columns(seen, h)
    alike = [np.allclose(np.abs(tilts[:, :, k]), np.abs(zero), atol=1e-4) for k in range(2)]
    assert sum(alike) == sideways
    assert bool(np.abs(zero).max() > 1e-4) is sideways
