"""The safety module as a device on the bus, with its relay and an operator at the pendant."""

from collections.abc import Sequence
from typing import Protocol

from sim_bus.can_bus.frame import Frame
from sim_bus.puck.codec import SafetyState, decode
from sim_bus.puck.safety_module import Lamp, Press, SafetyModule

NEVER_NS = 1 << 62
ACTIVATES_AFTER_NS = 500_000_000
"""The operator presses Shift-Activate once a program has sent torques for this long [ns]."""
_BREAK_NS = 200_000_000  # a pause of this length ends a program's run
_TICK_NS = 5_000_000
_TORQUE_IDENTIFIERS = (0x401, 0x402)


class Powered(Protocol):
    """A motor Puck, as the safety module's relay sees it."""

    def switch_off(self) -> None:
        """Cut the 48 V."""
        ...

    def switch_on(self) -> None:
        """Give the 48 V back."""
        ...


class SafetyNode:
    """Safety module, relay and operator.

    The operator presses Shift-Activate once in each run of a program, half a second after its first
    torques, and before that Shift-Idle where a fault of the run before still shows. After an E-STOP
    he does nothing by himself.

    Attributes:
        module: the safety module.
        handlers: identifiers of the frames that it hears.
        next_ns: when `tick` is due.
        has_operator: whether somebody is at the pendant.

    Args:
        module: the safety module.
        motors: the motor Pucks behind its relay.
    """

    def __init__(self, module: SafetyModule, motors: Sequence[Powered]) -> None:
        facts = module.facts
        self.module = module
        self.has_operator = True
        self.next_ns = NEVER_NS
        replies = {0x403 | node << 5 for node in facts.motors}
        self.handlers = frozenset({facts.node, *_TORQUE_IDENTIFIERS, *replies})
        self._motors = motors
        self._on = True
        self._began_ns: int | None = None
        self._heard_ns = -NEVER_NS

    def boot(self, time_ns: int) -> list[Frame]:
        """Power-on, which the module does not announce."""
        return []

    def receive(self, time_ns: int, frame: Frame) -> list[Frame]:
        """The frames that follow from one that was overheard."""
        decoded = decode(frame)
        if decoded is None:
            return []
        if frame.can_id in _TORQUE_IDENTIFIERS:
            self._note_torques(time_ns)
        return self._after(time_ns, self.module.receive(decoded, time_ns))

    def tick(self, time_ns: int) -> list[Frame]:
        """Frames of module and operator that are due without any input."""
        self.next_ns = NEVER_NS
        frames = self.module.tick(time_ns)
        if self._wants_to_activate(time_ns):
            self._began_ns = None
            faulty = self.module.shows_fault
            frames += self.module.press(Press.IDLE, time_ns) if faulty else []
            frames += self.module.press(Press.ACTIVATE, time_ns)
        return self._after(time_ns, frames)

    def press(self, button: Press, time_ns: int) -> list[Frame]:
        """A button of the pendant, whoever presses it."""
        return self._after(time_ns, self.module.press(button, time_ns))

    def fail(self, lamp: Lamp, time_ns: int) -> list[Frame]:
        """A fault that the module finds, for whatever reason."""
        return self._after(time_ns, self.module.fail(lamp, time_ns))

    def _note_torques(self, time_ns: int) -> None:
        if time_ns - self._heard_ns > _BREAK_NS:
            self._began_ns = time_ns
        self._heard_ns = time_ns

    def _wants_to_activate(self, time_ns: int) -> bool:
        if not self.has_operator or self._began_ns is None:
            return False
        if time_ns - self._heard_ns > _BREAK_NS:
            self._began_ns = None  # the program has stopped, so that nobody waits for it
            return False
        return time_ns - self._began_ns >= ACTIVATES_AFTER_NS

    def _after(self, time_ns: int, frames: list[Frame]) -> list[Frame]:
        """Let the relay follow the module, and see when something is due again."""
        on = self.module.state is not SafetyState.ESTOP
        if on != self._on:
            self._on = on
            for motor in self._motors:
                motor.switch_on() if on else motor.switch_off()
        busy = self.module.is_waiting or self._began_ns is not None
        if busy:
            self.next_ns = min(self.next_ns, time_ns + _TICK_NS)
        return frames
