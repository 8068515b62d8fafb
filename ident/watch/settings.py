"""Every number that decides what the watch tells."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class WatchSettings:
    """Settings of the watch.

    Attributes:
        false_alarms_per_hour: of motion, at most, as far as the model's errors are as assumed.
        motion_hz: cut-off of the filter that position and torque pass alike [Hz].
        speed_hz: cut-off of the velocity that tells of a reversal before these see it [Hz].
        rows_hz: at least so many rows of regression are kept in a second.
        start_s: rows that are left out while the filters fill [s].
        naming_windows: windows of motion after that with which a change is named.
        window_s: the odds are looked at after each [s].
        block_windows: windows after which the test begins anew.
        slowest_rad_s: a slower joint's friction is not known [rad/s].
        settling_s: nor is it for so long after that [s].
        values_per_s: independent values of the model's error in a second.
        noise_factor: the model's error on new motions beside that on those of its fit.
        friction_share: friction that comes and goes with temperature and days.
        payload_kg, payload_m: usual size of an undeclared load and of its distance [kg], [m].
        known_payload: part of these by which the trusted load may be off.
        force_n: usual size of a push [N].
        change_share: usual size of a change of friction.
    """

    false_alarms_per_hour: float = 0.01
    motion_hz: float = 8.0
    speed_hz: float = 25.0
    rows_hz: float = 40.0
    start_s: float = 0.4
    naming_windows: int = 4
    window_s: float = 0.5
    block_windows: int = 120
    slowest_rad_s: float = 0.05
    settling_s: float = 0.25
    values_per_s: float = 2.0
    noise_factor: float = 2.0
    friction_share: float = 0.05
    payload_kg: float = 0.5
    payload_m: float = 0.1
    known_payload: float = 0.04
    force_n: float = 10.0
    change_share: float = 0.2

    @property
    def least_log_odds(self) -> float:
        """Odds (logarithm) that are asked for: blocks in an hour over the false alarms in one."""
        blocks = 3600.0 / (self.block_windows * self.window_s)
        return math.log(blocks / self.false_alarms_per_hour)


DEFAULT = WatchSettings()
