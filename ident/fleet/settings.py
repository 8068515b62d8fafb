"""Every number that decides what a fleet's result says."""

from dataclasses import dataclass


@dataclass(frozen=True)
class FleetSettings:
    """Settings of the reduction and of the statistics.

    Attributes:
        stribeck_speeds_rad_s: of the two curves by which friction may rise at low speed [rad/s].
        slowest_rad_s: threshold of speed below which rows are left out, where the arm's settings
            have the data choose it [rad/s].
        false_alarm_share: share of false ones among all arms that are called changed.
        page_arms: with more arms than this, only those that have changed get a page of their own.
        gap_arms: so many changed arms, at most, are searched for the effect that came.
        gap_logs: logs before a change that the trusted model is fitted to, and after it that are
            searched, at most.
        type_arms: most arms of a type from which its spread is learned.
        type_logs: most logs of each of them.
        type_rounds: rounds of expectation and maximisation.
        least_logs: logs of an arm that must come before a change can begin.
        onsets: how many of the latest logs a change may begin at.
        changes: most changes of one arm.
        naming_logs: logs after those that told a change, which it must outlast (as far as there
            are any) and is named with.
        shown_logs: logs after a change for which it is told how small a one they would show.
        unseen_times: a change that is so many times as large as usual and would not be told by
            them is said to be one that they cannot show.
        friction_share: usual size of a change of friction, beside the type's mean.
        torque_share: usual size of a torque offset, beside the same.
        payload_kg, payload_m: usual size of a mass at the tool, and of its distance [kg], [m].
        zero_rad: usual size of a moved joint zero [rad].
    """

    stribeck_speeds_rad_s: tuple[float, ...] = (0.04, 0.15)
    slowest_rad_s: float = 0.05
    false_alarm_share: float = 0.05
    page_arms: int = 300
    gap_arms: int = 20
    gap_logs: int = 4
    type_arms: int = 24
    type_logs: int = 16
    type_rounds: int = 25
    least_logs: int = 3
    onsets: int = 60
    changes: int = 3
    naming_logs: int = 5
    shown_logs: int = 7
    unseen_times: float = 100.0
    friction_share: float = 0.2
    torque_share: float = 0.2
    payload_kg: float = 0.5
    payload_m: float = 0.1
    zero_rad: float = 0.01

    @property
    def reduction(self) -> tuple[object, ...]:
        """Those that a log's triangles follow from."""
        return (self.stribeck_speeds_rad_s, self.slowest_rad_s)


DEFAULT = FleetSettings()
