"""The simulated safety module of a classic WAM: it overhears torques and positions, and acts.

Limits TL and VL, fall-back to IDLE, E-STOP 0.5 s later if the arm is still too fast, IFAULT, ZERO
and PEN are Barrett's (wiki SafetyFeaturesPrecautions, libbarrett `safety_module`). Assumptions,
since no source tells them: the heartbeat's time-out, that MODE reaches the motor Pucks as a SET
from node 10, and that what arrives within the configuration gap is lost.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from sim_bus.can_bus.frame import Frame
from sim_bus.puck.codec import DecodedFrame, Mode, SafetyState, answer, mode_broadcast
from sim_bus.puck.firmware import motor_ids, safety_ids, width
from sim_bus.puck.memory import Memory
from sim_bus.puck.safety_speed import SafetySpeed
from wamctl.arm.arrays import Array

HEARTBEAT_NS = 90_000_000
"""Assumed; below the 100 ms by which libbarrett and OWD take the fault to have come."""
STILL_TOO_FAST_NS = 500_000_000
CONFIGURATION_GAP_NS = 10_000_000

_Q4_12 = 4096.0
_TORQUE_GROUPS = (1, 2)
_SAFE, _WARNING, _FAULT = 1, 2, 4
_HEX_DIGITS = (0x3F, 0x06, 0x5B)  # seven-segment patterns of 0, 1, 2
_LIMITS = {"TL1": 4731, "TL2": 5204, "VL1": 2048, "VL2": 4096}
_VOLTAGES = {"VOLTL1": 36, "VOLTL2": 30, "VOLTH1": 54, "VOLTH2": 57}


class Press(IntEnum):
    """Buttons of the pendant, by the bits that PEN shows while they are held."""

    ESTOP = 0
    ACTIVATE = 1
    IDLE = 2
    NONE = 3


class Lamp(IntEnum):
    """Lights of the pendant, by their place in PEN."""

    VELOCITY = 0
    TORQUE = 1
    VOLTAGE = 2
    HEARTBEAT = 3
    OTHER = 4


@dataclass(frozen=True)
class SafetyFacts:
    """Configuration of the module for its arm.

    Attributes:
        node: node id.
        version: VERS.
        motor_version: VERS of the motor Pucks, whose frames it overhears.
        motors: node ids of the motors, in order.
        radians_per_count: per motor, shape (n,) [rad].
        joint_from_motor: inverse of the transmission, shape (n, n).
    """

    node: int
    version: int
    motor_version: int
    motors: tuple[int, ...]
    radians_per_count: Array
    joint_from_motor: Array


class SafetyModule:
    """The safety Puck with its pendant.

    Attributes:
        facts: what it knows of its arm.
        state: MODE.
        lamps: state of each light.
        speed: what it measures of the arm's motion.
    """

    def __init__(self, facts: SafetyFacts, zeroed: bool) -> None:
        self.facts = facts
        self.state = SafetyState.IDLE
        self.lamps = dict.fromkeys(Lamp, _SAFE)
        self.speed = SafetySpeed()
        self._button = Press.NONE
        self._ids = safety_ids(facts.version)
        self._names = {number: name for name, number in self._ids.items()}
        self._torque_id = motor_ids(facts.motor_version)["T"]
        self._mode_id = self._ids["MODE"]
        self._memory = Memory(
            _LIMITS
            | _VOLTAGES
            | {"VERS": facts.version, "ROLE": 2, "SN": 2000, "ID": facts.node, "STAT": 2}
            | {"GRPA": 1, "GRPB": 2, "GRPC": 3, "VBUS": 48, "TEMP": 40, "THERM": 40}
        )
        self._memory.put("ZERO", int(zeroed))
        self._counts: dict[int, int] = {}
        self._heard_ns = 0
        self._idle_ns: int | None = None
        self._configured_ns = -CONFIGURATION_GAP_NS

    @property
    def zeroed(self) -> bool:
        """Whether the host has told that positions are defined, and power has not gone since."""
        return self._memory.value("ZERO") == 1

    @property
    def shows_fault(self) -> bool:
        """Whether a light of the pendant shows a fault."""
        return _FAULT in self.lamps.values()

    @property
    def is_waiting(self) -> bool:
        """Whether something will happen without another frame: see `tick`."""
        return self.state is SafetyState.ACTIVE or self._idle_ns is not None

    def press(self, button: Press, now_ns: int) -> list[Frame]:
        """A button of the pendant, pressed and let go; the frames that follow from it."""
        if button is Press.ESTOP:
            self._stop_all()
            return []
        if button is Press.IDLE:
            self.lamps = dict.fromkeys(Lamp, _SAFE)
            return self._go_idle(now_ns)
        if button is Press.ACTIVATE and self.state is SafetyState.IDLE:
            return self._activate(now_ns)
        return []

    def lose_zero(self) -> None:
        """Forget that positions are defined, as after a loss of power."""
        self._memory.put("ZERO", 0)

    def fail(self, lamp: Lamp, now_ns: int) -> list[Frame]:
        """Fall back to IDLE; in IDLE and E-STOP there is nothing to fall back from."""
        if self.state is not SafetyState.ACTIVE:
            return []
        self.lamps[lamp] = _FAULT
        return self._go_idle(now_ns)

    def tick(self, now_ns: int) -> list[Frame]:
        """Let time pass: heartbeat, and the time within which a fallen-back arm must slow down."""
        if self.state is SafetyState.ACTIVE and now_ns - self._heard_ns > HEARTBEAT_NS:
            return self.fail(Lamp.HEARTBEAT, now_ns)
        if self._idle_ns is not None and now_ns - self._idle_ns >= STILL_TOO_FAST_NS:
            self._idle_ns = None
            if self._too_fast("VL2"):
                self._stop_all()
        return []

    def receive(self, decoded: DecodedFrame, now_ns: int) -> list[Frame]:
        """Frames that follow from one that was overheard, whoever it was for."""
        if decoded.group in _TORQUE_GROUPS and decoded.sender == 0:
            return self._overhear_torques(decoded, now_ns)
        if decoded.position is not None and decoded.sender in self.facts.motors:
            return self._overhear_position(decoded.sender, decoded.position, now_ns)
        name = self._names.get(decoded.property_id)
        if decoded.node != self.facts.node or name is None:
            return []
        if not decoded.is_set:
            live = {"MODE": self.state, "PEN": self.pen}
            value = live.get(name, self._memory.value(name))
            return [answer(self.facts.node, decoded.property_id, value, width(name))]
        return self._configure(name, decoded.value, now_ns)

    @property
    def pen(self) -> int:
        """Button, lights and display, as PEN packs them."""
        lights = sum(state << 3 * lamp for lamp, state in self.lamps.items())
        active = self.state is SafetyState.ACTIVE
        idle = self.state is SafetyState.IDLE
        display = _HEX_DIGITS[self.state]
        return self._button << 26 | active << 25 | idle << 24 | display << 16 | lights

    def _configure(self, name: str, value: int | None, now_ns: int) -> list[Frame]:
        early = now_ns - self._configured_ns < CONFIGURATION_GAP_NS
        self._configured_ns = now_ns
        if early or value is None:
            return []
        if name == "MODE":
            return self._lower(value, now_ns)
        self._memory.store(name, value, self._names)
        return []

    def _lower(self, value: int, now_ns: int) -> list[Frame]:
        """The host may only lower the mode; all else is ignored."""
        if value == SafetyState.ESTOP:
            self._stop_all()
        elif value == SafetyState.IDLE and self.state is SafetyState.ACTIVE:
            return self._go_idle(now_ns)
        return []

    def _overhear_torques(self, decoded: DecodedFrame, now_ns: int) -> list[Frame]:
        torques = decoded.torques
        if torques is None or decoded.property_id != self._torque_id:
            return []
        self._heard_ns = now_ns
        largest = max(abs(t) for t in torques)
        if largest >= self._memory.value("TL2"):
            return self.fail(Lamp.TORQUE, now_ns)
        self._warn(Lamp.TORQUE, largest >= self._memory.value("TL1"))
        return []

    def _overhear_position(self, node: int, counts: int, now_ns: int) -> list[Frame]:
        self._counts[node] = counts
        if len(self._counts) < len(self.facts.motors):
            return []
        angles = np.array([self._counts[m] for m in self.facts.motors])
        self._counts = {}
        self.speed.add(
            now_ns, self.facts.joint_from_motor @ (angles * self.facts.radians_per_count)
        )
        return self._watch_speed(now_ns)

    def _watch_speed(self, now_ns: int) -> list[Frame]:
        ignored = self._memory.value("IFAULT")
        if ignored > 0:
            self._memory.put("IFAULT", ignored - 1)
            return []
        if self._too_fast("VL2"):
            return self.fail(Lamp.VELOCITY, now_ns)
        self._warn(Lamp.VELOCITY, self._too_fast("VL1"))
        return []

    def _too_fast(self, name: str) -> bool:
        limit = self._memory.value(name)
        return limit > 0 and self.zeroed and self.speed.m_s >= limit / _Q4_12

    def _warn(self, lamp: Lamp, on: bool) -> None:
        if self.lamps[lamp] != _FAULT:
            self.lamps[lamp] = _WARNING if on else _SAFE

    def _go_idle(self, now_ns: int) -> list[Frame]:
        if self.state is SafetyState.ACTIVE:
            self._idle_ns = now_ns
        self.state = SafetyState.IDLE
        return [mode_broadcast(self.facts.node, self._mode_id, Mode.IDLE)]

    def _activate(self, now_ns: int) -> list[Frame]:
        if self.shows_fault:
            return []
        self.state, self._heard_ns, self._idle_ns = SafetyState.ACTIVE, now_ns, None
        return [mode_broadcast(self.facts.node, self._mode_id, Mode.TORQUE)]

    def _stop_all(self) -> None:
        """E-STOP: the motors' power goes, and with it every position."""
        self.state, self._idle_ns = SafetyState.ESTOP, None
        self.speed.forget()
        self.lose_zero()
