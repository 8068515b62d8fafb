"""Serving a simulated arm on a bus, on one of two clocks."""

import os
import time
from typing import Protocol

from sim_bus.can_bus.arbitration import Arbitration
from sim_bus.can_bus.frame import Frame
from sim_bus.can_bus.frame_length import BitTiming
from sim_bus.can_bus.hub import Hub, Received
from sim_bus.can_bus.waiting import Source, readable, soon_readable
from sim_bus.node import SyncSchedule

_LONGEST_WAIT_NS = 1_000_000  # the physics stays this close behind the clock
_LONGEST_HOLD_UP_NS = 500_000_000
_NEVER_NS = 1 << 62


class Arm(Protocol):
    """An arm that can be served; times are arguments [ns]."""

    def boot(self, time_ns: int) -> list[Frame]:
        """Power-on."""
        ...

    def receive(self, time_ns: int, frame: Frame) -> list[Frame]:
        """The answers to a frame of a program, once it has passed."""
        ...

    def overhear(self, time_ns: int, frame: Frame) -> list[Frame]:
        """The answers to a frame of the arm's own devices, once it has passed."""
        ...

    def tick(self, time_ns: int) -> list[Frame]:
        """Frames that are due by a time without any input."""
        ...

    def run_physics(self, time_ns: int) -> None:
        """Let the arm move until a time, under the torques of the present."""
        ...

    @property
    def next_ns(self) -> int:
        """When `tick` is due at the earliest."""
        ...


class Service(Protocol):
    """One of the two clocks."""

    def start(self) -> None:
        """Switch the drives on."""
        ...

    def take(self, received: Received) -> None:
        """A frame that a program has sent."""
        ...

    def catch_up(self, until_ns: int) -> float | None:
        """Do what is due by an instant of the monotonic clock [ns].

        All frames sent by then have been taken. Returns the time [s] until something will be due;
        None if only a frame can matter.
        """
        ...


class RealTime:
    """The arm on the monotonic clock: every frame takes its time on the wire.

    A frame reaches its receivers when its last bit would have; with a hub that gathers them, the
    programs get it when the last of those has passed that follow it without a pause.

    Attributes:
        load: how busy the bus was.
    """

    def __init__(self, arm: Arm, hub: Hub, timing: BitTiming) -> None:
        self._arm = arm
        self._hub = hub
        self._wire = Arbitration(timing)
        self.load = self._wire.load
        self._origin_ns = time.monotonic_ns()
        self._last_ns, self._given_out_by_ns = 0, _NEVER_NS

    def start(self) -> None:
        """Switch the drives on."""
        self._origin_ns = time.monotonic_ns()
        self._send(0, self._arm.boot(0))

    def take(self, received: Received) -> None:
        """A frame that waits for the wire since it was sent."""
        now_ns = time.monotonic_ns()
        sent_ns = now_ns if received.sent_ns is None else min(received.sent_ns, now_ns)
        self._wire.offer(sent_ns - self._origin_ns, received.frame, received.sender)

    def catch_up(self, until_ns: int) -> float | None:
        """Let all frames arrive that are due, and the drives and the arm go on."""
        now = self._without_pauses(until_ns)
        while (arrival := self._wire.take(now)) is not None:
            self._send(arrival.time_ns, self._arm.tick(arrival.time_ns))
            self._hub.deliver([arrival.frame], arrival.sender, arrival.time_ns + self._origin_ns)
            hear = self._arm.overhear if arrival.sender is self else self._arm.receive
            self._send(arrival.time_ns, hear(arrival.time_ns, arrival.frame))
        self._give_out(now)
        self._send(now, self._arm.tick(now))
        self._arm.run_physics(now)
        due = min(self._arm.next_ns, now + _LONGEST_WAIT_NS)
        wire_ns = self._wire.pause_ns() if self._hub.gathers else self._wire.next_ns()
        if wire_ns is not None:
            due = min(due, wire_ns)
        return max(0, due + self._origin_ns - time.monotonic_ns()) * 1e-9

    def _give_out(self, now: int) -> None:
        """Let the programs have what has passed: at once, or in a pause, or after a while."""
        if not (self._hub.gathers and self._wire.is_busy) or now >= self._given_out_by_ns:
            self._hub.flush()
            self._given_out_by_ns = _NEVER_NS
        else:
            self._given_out_by_ns = min(self._given_out_by_ns, now + _LONGEST_WAIT_NS)

    def _without_pauses(self, until_ns: int) -> int:
        """Time of the arm [ns], which stands still while this process is not let run at all."""
        now = until_ns - self._origin_ns
        if now - self._last_ns > _LONGEST_HOLD_UP_NS:
            self._origin_ns = until_ns - self._last_ns
            now = self._last_ns
        self._last_ns = now
        return now

    def _send(self, time_ns: int, frames: list[Frame]) -> None:
        for frame in frames:
            self._wire.offer(time_ns, frame._replace(passed_ns=0), self)


class Lockstep:
    """The arm on virtual time, which goes on by one period at every frame that opens a cycle.

    The physics runs ahead while the program works out the next torques: after the opening frame of
    cycle k up to where its torques can act, which is their own arrival. So a run is the same every
    time, whatever the machine does meanwhile.

    Args:
        arm: drives and physics.
        hub: programs on the bus.
        period_ns: cycle time.
        schedule: frames that open and close a cycle.
    """

    def __init__(self, arm: Arm, hub: Hub, period_ns: int, schedule: SyncSchedule) -> None:
        self._arm = arm
        self._hub = hub
        self._period_ns = period_ns
        self._schedule = schedule
        self._now_ns = 0
        self._origin_ns = time.monotonic_ns()
        self._passes = schedule.sets_up_by_time

    def start(self) -> None:
        """Switch the drives on."""
        self._pass_on(self._arm.boot(0))

    def take(self, received: Received) -> None:
        """A frame that a program has sent."""
        frame, sender = received.frame, received.sender
        schedule, opens = self._schedule, self._schedule.opens(frame)
        if opens:
            self._passes = False
            self._now_ns += self._period_ns
            self._arm.run_physics(self._now_ns)
        elif self._passes:
            periods = (time.monotonic_ns() - self._origin_ns) // self._period_ns
            self._now_ns = periods * self._period_ns
        if opens or self._passes:
            self._pass_on(self._arm.tick(self._now_ns))
        late_ns = schedule.torques_after_ns if frame.can_id in schedule.torque_ids else 0
        self._hub.deliver([frame], sender, self._now_ns)
        self._pass_on(self._arm.receive(self._now_ns + late_ns, frame))
        self._hub.settle(sender, self._now_ns)
        if opens:
            self._hub.flush()
            self._arm.run_physics(self._now_ns + schedule.torques_after_ns)
        elif frame.can_id == schedule.closing_id:
            self._arm.run_physics(self._now_ns + self._period_ns)

    def catch_up(self, until_ns: int) -> float | None:
        """Let the programs have the answers; nothing is due before the next frame."""
        self._hub.flush()
        return None

    def _pass_on(self, frames: list[Frame]) -> None:
        """Give the devices' frames to the programs and to the other devices."""
        while frames:
            self._hub.deliver(frames, self, self._now_ns)
            frames = [a for frame in frames for a in self._arm.overhear(self._now_ns, frame)]


def serve(service: Service, hub: Hub, stop: Source | None) -> None:
    """Serve until an exception ends it, or the stop source is closed.

    Args:
        service: the clock.
        hub: programs on the bus.
        stop: a stream whose end means to stop.
    """
    service.start()
    until_ns = time.monotonic_ns()
    while True:
        timeout_s = service.catch_up(until_ns)
        sources = [*hub.sources(), *([stop] if stop else [])]
        wait = soon_readable if timeout_s is None else readable
        ready = wait(sources, timeout_s)
        if stop is not None and stop in ready and not os.read(stop.fileno(), 4096):
            return
        until_ns = time.monotonic_ns()
        for received in hub.receive([s for s in ready if s is not stop]):
            service.take(received)
