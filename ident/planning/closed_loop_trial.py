"""A motion tried out in closed loop on the identified arm, with each rival answer planted in it."""

from collections.abc import Sequence

import numpy as np

from ident.effects.simulated_model import simulation_of
from ident.excitation.design import DesignTask
from ident.planning.hypotheses import Hypothesis
from ident.simulation.configuration import controller_for, wire_for
from ident.simulation.loop import run
from wamctl.arm.trajectory import FourierSeries, reference

MOST_TRACKING = 0.8
"""Share of the guard's tracking error that a trial may reach."""


def tracking(
    place: DesignTask, found: Sequence[Hypothesis], series: FourierSeries
) -> dict[str, float]:
    """The largest tracking error along a motion in units of what the guard allows, by answer.

    Args:
        place: the arm, its controller, drives and guard.
        found: the answers.
        series: the motion; one period and its ramps are run.
    """
    arm = place.arm
    motion = reference(series, 1, arm.excitation.ramp_s, arm.bus.period_s)
    most = np.array(arm.safety.tracking_error_rad)
    controller, wire = controller_for(arm, place.robot), wire_for(arm)
    shares = {}
    for h in found:
        made = run(simulation_of(h.model), controller, wire, (motion.q, motion.qd, motion.qdd))
        share = float((np.abs(made.q - motion.q).max(axis=0) / most).max())
        shares[h.name] = share if np.isfinite(share) else np.inf
    return shares
