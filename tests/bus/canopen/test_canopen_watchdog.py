"""The watchdog's frames disable the drives while the loop hangs, and time stands still."""

import time

import numpy as np

from sim_bus.canopen.ds402 import State
from wamctl.experiment.session import connected
from wamctl.safety.watchdog import watched

DEADLINE_S = 60.0


def test_drives_whose_loop_hangs_are_disabled(serve_arms):
    with serve_arms() as arm, connected(arm.setup) as connection:
        drives, clock = connection.drives, connection.clock
        drives.start()
        clock.start()
        drives.enable()
        for _ in range(100):
            clock.tick()
            enabled = drives.sample(clock).enabled
            drives.send(np.full(7, 0.01 * enabled))
            if enabled:
                break
        clock.tick()
        drives.sample(clock)
        motors = arm.witness.motors
        assert all(m.motor.torque_permille for m in motors)
        with watched(connection.bus, drives.cut_off_frames(), 0.05) as heart:
            heart.begin()
            end_s = time.monotonic() + DEADLINE_S
            while any(m.is_enabled for m in motors) and time.monotonic() < end_s:
                time.sleep(0.01)
        assert [m.motor.torque_permille for m in motors] == [0] * 7
        assert {m.motor.state for m in motors} == {State.SWITCH_ON_DISABLED}
