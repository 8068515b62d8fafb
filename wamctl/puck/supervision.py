"""What the Pucks are asked beside the cycle, and what their answers mean: no bus, no clock."""

from collections import deque
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from wamctl.puck import frames
from wamctl.puck.enumerations import Group, MotorMode, SafetyMode
from wamctl.puck.errors import FrameError
from wamctl.puck.pendant import Light, decode_pendant
from wamctl.puck.properties import Properties

STEADY_CYCLES = 20
"""One question in so many cycles while nothing changes: 25 a second at 500 Hz."""
WALKING_CYCLES = 2
"""The same while the arm changes its mode."""
ZERO_TURNS = 4
"""One in so many questions on the way to torque is for ZERO, so that no torque comes without it."""
REASON_CYCLES = 5
"""So long an answer about the pendant is awaited when the module has left ACTIVE."""
SILENT_CYCLES = 100
"""For so long the safety module may leave questions without an answer: 0.2 s at 500 Hz."""


MODE = 8
"""Number of MODE in every firmware, so that a whole group can be asked."""


class Question(NamedTuple):
    """A property of a node or group.

    Attributes:
        identifier: of the frame that asks.
        property_id: number of the property.
    """

    identifier: int
    property_id: int


class Supervision:
    """Modes of n motor Pucks and their safety module, and the first fault among them.

    Attributes:
        modes: MODE of each motor Puck since the last change of goal; None until it was heard.
        safety_mode: MODE of the safety module; None until it was heard.
        fault: why the drives cannot be trusted any more; None if they can.
        too_hot: why the arm should stop although they can; None if it need not.
        yields: the module has left ACTIVE, so that torque is to be zero.

    Args:
        nodes: node of each motor Puck.
        names: what to call each of them.
        motors: properties of the firmware of each of them.
        safety_node: node of the safety module.
        safety: properties of its firmware.
        hottest_c: limit of each motor Puck's temperature [deg C]; None for none.
    """

    def __init__(
        self,
        nodes: Sequence[int],
        names: Sequence[str],
        motors: Sequence[Properties],
        safety_node: int,
        safety: Properties,
        hottest_c: float | None,
    ) -> None:
        self.modes: list[int | None] = [None] * len(nodes)
        self.safety_mode: int | None = None
        self.fault: str | None = None
        self.too_hot: str | None = None
        self.yields = False
        self._nodes, self._names, self._safety_node = list(nodes), names, safety_node
        self._mode_of_all = Question(frames.to_group(Group.WHOLE_ARM), MODE)
        self._hottest_c = hottest_c
        self._temperature_ids = [properties["TEMP"] for properties in motors]
        self._mode, self._zero, self._pen = (
            Question(frames.to_node(safety_node), safety[name]) for name in ("MODE", "ZERO", "PEN")
        )
        self._others = list(self._by_turns())
        self._wants_torque = False
        self._arrived = False
        self._urgent: deque[Question] = deque()
        self._turn = 0
        self._waited = 0
        self._asked_in: int | None = None  # cycle of the oldest question without an answer

    def go(self, wants_torque: bool) -> None:
        """From now on the arm is to give torque, or none."""
        self._wants_torque, self._arrived = wants_torque, False
        self.modes = [None] * len(self.modes)
        self.safety_mode = None
        self._turn = 0
        self._urgent.clear()

    @property
    def enabled(self) -> bool:
        """Whether module and Pucks have all said that they give torque."""
        return self.safety_mode == SafetyMode.ACTIVE and all(
            mode == MotorMode.TORQUE for mode in self.modes
        )

    @property
    def disabled(self) -> bool:
        """Whether module and Pucks have all said that they give none."""
        return self.safety_mode in (SafetyMode.IDLE, SafetyMode.ESTOP) and all(
            mode == MotorMode.IDLE for mode in self.modes
        )

    def alarm(self) -> None:
        """The module has spoken by itself, or a Puck has not: ask for its mode at once."""
        if self._mode not in self._urgent:
            self._urgent.append(self._mode)

    def next_question(self, cycle: int) -> Question | None:
        """What to ask in this cycle, if anything."""
        self._wait_for_reason()
        self._check_silence(cycle)
        if self._urgent:
            return self._noted(self._urgent.popleft(), cycle)
        interval = STEADY_CYCLES if self._arrived else WALKING_CYCLES
        if cycle % interval:
            return None
        self._turn += 1
        return self._noted(self._steady() if self._arrived else self._walking(), cycle)

    def hear(self, node: int, data: bytes) -> bool:
        """Take in the answer of a node; False if it is none to a question of this class."""
        if node == self._safety_node:
            return self._hear_module(data)
        if node not in self._nodes:
            return False
        slot = self._nodes.index(node)
        mode, celsius = _value(MODE, data), _value(self._temperature_ids[slot], data)
        if mode is not None:
            self._take_motor_mode(slot, mode)
        elif celsius is not None:
            self._take_temperature(slot, celsius)
        return mode is not None or celsius is not None

    def _take_motor_mode(self, slot: int, mode: int) -> None:
        self.modes[slot] = mode
        self._note_arrival()
        if self._must_give_torque and mode != MotorMode.TORQUE:
            self._fail(f"{self._names[slot]} shows MODE {_word(mode)} instead of TORQUE")

    def _take_temperature(self, slot: int, celsius: int) -> None:
        if self._hottest_c is not None and celsius > self._hottest_c and self.too_hot is None:
            self.too_hot = (
                f"{self._names[slot]} has {celsius} deg C, above its limit of "
                f"{self._hottest_c:.1f} deg C"
            )

    def _hear_module(self, data: bytes) -> bool:
        for question, take in (
            (self._mode, self._take_mode),
            (self._zero, self._take_zero),
            (self._pen, self._take_pen),
        ):
            value = _value(question.property_id, data)
            if value is not None:
                self._asked_in = None
                take(value)
                return True
        return False

    def _take_mode(self, mode: int) -> None:
        before, self.safety_mode = self.safety_mode, mode
        self._note_arrival()
        if mode == SafetyMode.ESTOP:
            self._fail("E-STOP: the safety module has cut the power of all motors")
        elif mode != SafetyMode.ACTIVE and self._has_left(before):
            self.yields = True
            self._urgent.append(self._pen)

    def _has_left(self, before: int | None) -> bool:
        """Whether the module was ACTIVE and should be, be it that not all Pucks have followed."""
        activated = self._wants_torque and before == SafetyMode.ACTIVE and not self.yields
        return activated or self._must_give_torque

    def _take_zero(self, zero: int) -> None:
        if zero != 1:
            self._fail(f"safety module lost the arm's zero (ZERO = {zero})")

    def _take_pen(self, pen: int) -> None:
        try:
            faults = decode_pendant(pen).lit(Light.FAULT)
        except FrameError as error:
            self._fail(f"safety module fell back to IDLE ({str(error).rstrip('.')})")
            return
        if faults:
            self._fail(f"safety module fell back to IDLE with a fault of {', '.join(faults)}")
        else:
            self._fail("safety module went to IDLE, since Shift-Idle was pressed on the pendant")

    def _wait_for_reason(self) -> None:
        if self.yields and self.fault is None:
            self._waited += 1
            if self._waited > REASON_CYCLES:
                self._fail("safety module fell back to IDLE, and does not say why")

    def _walking(self) -> Question:
        """The module until it has arrived, then all Pucks at once; in between its zero."""
        if self._wants_torque and self._turn % ZERO_TURNS == 0:
            return self._zero
        target = SafetyMode.ACTIVE if self._wants_torque else SafetyMode.IDLE
        return self._mode if self.safety_mode != target else self._mode_of_all

    def _steady(self) -> Question:
        """Every other time the module's mode, in between all the rest."""
        if self._turn % 2:
            return self._mode
        return self._others[self._turn // 2 % len(self._others)]

    def _by_turns(self) -> Iterator[Question]:
        for node, temperature in zip(self._nodes, self._temperature_ids, strict=True):
            yield self._zero
            yield Question(frames.to_node(node), MODE)
            if self._hottest_c is not None:
                yield Question(frames.to_node(node), temperature)

    @property
    def _must_give_torque(self) -> bool:
        return self._wants_torque and self._arrived and not self.yields

    def _noted(self, question: Question, cycle: int) -> Question:
        if question.identifier == self._mode.identifier and self._asked_in is None:
            self._asked_in = cycle
        return question

    def _check_silence(self, cycle: int) -> None:
        if self._asked_in is not None and cycle - self._asked_in > SILENT_CYCLES:
            self._fail(f"safety module has not answered for {SILENT_CYCLES} cycles")

    def _note_arrival(self) -> None:
        self._arrived |= self.enabled if self._wants_torque else self.disabled

    def _fail(self, cause: str) -> None:
        self.fault = self.fault or cause


def _value(property_id: int, data: bytes) -> int | None:
    try:
        return frames.decode_reply(property_id, data)
    except FrameError:
        return None


def _word(mode: int) -> str:
    return MotorMode(mode).name if mode in tuple(MotorMode) else str(mode)
