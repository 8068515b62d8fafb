"""What the simulated arm itself says of a stop."""

from dataclasses import dataclass

from sim_bus.assembly import Simulation
from sim_bus.can_bus.frame import Frame
from sim_bus.server import Arm

ALONE_S = 0.2


@dataclass(frozen=True)
class Span:
    """A stretch of simulated time without a change.

    Attributes:
        until_ns: its end.
        torques: of the motors, as their drives make it [N m].
        enabled: how many drives are enabled.
    """

    until_ns: int
    torques: tuple[float, ...]
    enabled: int


@dataclass(frozen=True)
class Testimony:
    """What has happened to the arm.

    Attributes:
        said: a sentence for each fault that has begun.
        first_ns: time of the first frame that opened a cycle.
        spans: one after the other, from power-on to a fifth of a second after the program.
    """

    said: tuple[str, ...]
    first_ns: int
    spans: tuple[Span, ...]


class Witness:
    """An arm that remembers what its drives did."""

    def __init__(self, arm: Arm, simulation: Simulation) -> None:
        self.first_ns = 0
        self.spans: list[Span] = []
        self._arm, self._simulation = arm, simulation
        self.boot, self.tick, self.overhear = arm.boot, arm.tick, arm.overhear

    @property
    def next_ns(self) -> int:
        """When `tick` is due."""
        return self._arm.next_ns

    def receive(self, time_ns: int, frame: Frame) -> list[Frame]:
        """A frame of the program."""
        if not self.first_ns and self._simulation.schedule.opens(frame):
            self.first_ns = time_ns
        return self._arm.receive(time_ns, frame)

    def run_physics(self, time_ns: int) -> None:
        """Pass time on."""
        arm = self._simulation.arm
        torques = tuple(motor.motor_torque_nm for motor in arm.motors)
        enabled = sum(motor.is_enabled for motor in arm.motors)
        self._arm.run_physics(time_ns)
        self.spans.append(Span(time_ns, torques, enabled))

    def stay_alone(self) -> None:
        """A fifth of a second without a program, which lockstep would not let pass."""
        period_ns = self._simulation.period_ns
        now_ns = self.spans[-1].until_ns if self.spans else 0
        for _ in range(round(ALONE_S * 1e9) // period_ns):
            now_ns += period_ns
            for frame in self.tick(now_ns):
                self.overhear(now_ns, frame)
            self.run_physics(now_ns)
