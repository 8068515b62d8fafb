"""Friction of motors that drive two joints, in the simulated arm."""

from dataclasses import replace

import numpy as np
from closed_loop import recorded, source_of, wam

from ident.gap.options import Options
from ident.gap.search import search
from ident.gap.selection.estimates import final_estimates
from ident.gap.settings import Significance
from wamctl.arm.config import load_arm_file

LEVELS = (0.12, 0.16)  # N m, of the two motors that turn joints 2 and 3


def test_shared_motors_are_named_with_their_sizes():
    """Nothing says how they turn round: the interval spans another way of it."""
    arm = wam()
    rows = np.array(load_arm_file("wam7.yaml").transmission.motor_from_joint)[[1, 2]]
    rows /= np.abs(rows).max(axis=1, keepdims=True)
    arm = replace(
        arm,
        friction_rows=np.vstack([arm.friction_rows, rows]),
        coulomb=np.append(arm.coulomb, LEVELS),
        bristle=np.append(arm.bristle, np.zeros(2)),
    )
    found = search(source_of(recorded(arm)), Options(null_runs=1), lambda _: None)
    (only,) = found.verdict.effects
    assert (only.candidate.effect, only.candidate.joints) == ("coupled_friction", (1, 2))
    narrow, wide = (
        final_estimates(found.rows, found.end, Significance(), known).parameters[0]
        for known in ((), found.verdict.effects)
    )
    sizes = sorted(value.value for name, value in wide.items() if name.startswith("coulomb"))
    assert np.allclose(sizes, LEVELS, rtol=0.01)
    assert all(wide[name].sd > value.sd for name, value in narrow.items())
