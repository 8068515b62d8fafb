"""The watchdog's frames idle classic Pucks while the loop hangs, and time stands still."""

import time

import numpy as np

from wamctl.puck.enumerations import MotorMode
from wamctl.safety.watchdog import watched

DEADLINE_S = 60.0


def test_pucks_whose_loop_hangs_are_idled(classic):
    with classic.drives() as rig:
        drives = rig.enabled().drives
        rig.cycle(np.full(7, 0.01))
        rig.cycle(np.full(7, 0.01))
        assert all(puck.torque_units for puck in classic.pucks)
        with watched(drives._bus, drives.cut_off_frames(), 0.05) as heart:
            heart.begin()
            end_s = time.monotonic() + DEADLINE_S
            while any(puck.is_enabled for puck in classic.pucks) and time.monotonic() < end_s:
                time.sleep(0.01)
        assert [puck.torque_units for puck in classic.pucks] == [0] * 7
        assert {puck.mode for puck in classic.pucks} == {MotorMode.IDLE}
