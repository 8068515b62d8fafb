"""One simulated classic motor Puck: frames in, frames out, with the time as an argument."""

from collections.abc import Callable
from dataclasses import dataclass

from sim_bus.can_bus.frame import ERROR, Frame
from sim_bus.puck.codec import DecodedFrame, Mode, Stat, answer, decode, position_answer
from sim_bus.puck.firmware import MONITOR, motor_ids, width
from sim_bus.puck.memory import Memory

BOOT_NS = 900_000_000
"""From SET STAT = 2 to the first answer; libbarrett waits 1.0 s."""
HAZARD_NS = 600_000_000
"""This long before its first answer, while its transceiver starts, traffic harms the bus."""
NEVER_NS = 1 << 62
BUS_OFF = Frame(ERROR | 0x40, bytes(8))
"""The host's controller has gone bus-off."""

_BOARD_C = 40  # Pucks run from about 40 degrees Celsius up
_FROM_SAFETY = 0x540
_MAGNETIC_ENCODER = 0x0100
_JOINT_ENCODER = 0x4000
_SUPPLY_V = 48
_LOWER_ARM = 4  # motors 1 to 4
_LARGEST_TORQUE = 8191


@dataclass(frozen=True)
class PuckFacts:
    """Built-in properties of a Puck.

    Attributes:
        node: node id.
        version: VERS.
        poles: POLES of its motor.
        counts: CTS, counts per motor revolution.
        units_per_nm: IPNM, torque units per N m at the motor.
    """

    node: int
    version: int
    poles: int
    counts: int
    units_per_nm: int


class PuckDrive:
    """A motor Puck.

    Attributes:
        facts: what is built in.
        stat: whether the monitor or the firmware runs.
        mode: MODE; IDLE shorts the motor's phases, which brakes.
        torque_units: torque that acts, in Puck units; 0 unless MODE is TORQUE.
        powered: whether the 48 V are on.
        next_ns: when `tick` is due.

    Args:
        facts: what is built in.
        encoder: gives the position of the motor at this instant [counts].
        joint_encoder: gives the position of the joint's own encoder [counts], if there is one.
    """

    def __init__(
        self,
        facts: PuckFacts,
        encoder: Callable[[], int],
        joint_encoder: Callable[[], int] | None = None,
    ) -> None:
        self.facts = facts
        self.stat = Stat.READY
        self.mode = Mode.IDLE
        self.torque_units = 0
        self.powered = True
        self.next_ns = NEVER_NS
        self._encoder, self._joint_encoder = encoder, joint_encoder
        self._ids = motor_ids(facts.version)
        self._names = {number: name for name, number in self._ids.items()}
        self._zero_counts = 0
        self._memory = Memory(_factory_values(facts, joint_encoder is not None))
        self._find_identifiers()

    @property
    def is_enabled(self) -> bool:
        """Whether it drives its motor; otherwise the phases are shorted."""
        return self.mode is Mode.TORQUE

    @property
    def motor_torque_nm(self) -> float:
        """Torque at the rotor [N m]."""
        return self.torque_units / self.facts.units_per_nm

    def boot(self, time_ns: int) -> list[Frame]:
        """Power-on, which a Puck does not announce."""
        return []

    def tick(self, time_ns: int) -> list[Frame]:
        """Let time pass: a Puck that was woken starts its firmware."""
        if time_ns >= self.next_ns:
            self.next_ns, self.stat = NEVER_NS, Stat.READY
            self._find_identifiers()
        return []

    def switch_off(self) -> None:
        """Cut the 48 V: torque, mode and position are lost."""
        self.powered = False
        self._reset()

    def switch_on(self) -> None:
        """Give the 48 V back: the monitor runs, and the position counts from here."""
        self.powered = True
        self._memory.restart()
        self._zero_counts = self._encoder()
        self._reset()

    def receive(self, time_ns: int, frame: Frame) -> list[Frame]:
        """The answer to a frame, if there is one; a SET gets none."""
        if self.next_ns != NEVER_NS:
            return [BUS_OFF] if time_ns > self.next_ns - HAZARD_NS else []
        decoded = decode(frame)
        if decoded is None:
            return []
        if self.stat is Stat.RESET:
            return self._monitor(decoded, time_ns)
        name = self._names.get(decoded.property_id)
        if name is None:
            return []
        if decoded.is_set:
            self._set(name, decoded)
            return []
        return [self._get(name)]

    def _find_identifiers(self) -> None:
        """Which frames concern it, by its power, its state and its groups."""
        value = self._memory.value
        groups = {0, value("GRPA"), value("GRPB"), value("GRPC")}
        everything = range(0x800) if self.next_ns != NEVER_NS else ()
        own = {self.facts.node, *(0x400 | g for g in groups), *(_FROM_SAFETY | g for g in groups)}
        self.handlers = frozenset(everything or own if self.powered else ())

    def _reset(self) -> None:
        self.stat, self.mode, self.torque_units = Stat.RESET, Mode.IDLE, 0
        self.next_ns = NEVER_NS
        self._find_identifiers()

    def _monitor(self, decoded: DecodedFrame, time_ns: int) -> list[Frame]:
        if decoded.is_set:
            if decoded.property_id == MONITOR["STAT"] and decoded.value == Stat.READY:
                self.next_ns = time_ns + BOOT_NS
                self._find_identifiers()
            return []
        name = next((n for n, number in MONITOR.items() if number == decoded.property_id), None)
        if name is None:
            return []
        value = self.stat if name == "STAT" else self._memory.value(name)
        return [answer(self.facts.node, decoded.property_id, value, width(name))]

    def _get(self, name: str) -> Frame:
        node, counts = self.facts.node, self._encoder()
        if name == "P":
            joint = self._joint_encoder() if self._joint_encoder else None
            return position_answer(node, counts - self._zero_counts, joint)
        live = {"STAT": self.stat, "MODE": self.mode, "T": self.torque_units}
        live["MECH"] = counts % self.facts.counts
        return answer(node, self._ids[name], live.get(name, self._memory.value(name)), width(name))

    def _set(self, name: str, decoded: DecodedFrame) -> None:
        value = decoded.value
        if name == "T":
            self._set_torque(decoded)
        elif value is None:
            return
        elif name == "MODE":
            self._set_mode(value)
        elif name == "STAT":
            if value == Stat.RESET:
                self._reset()
        elif name == "P":
            self._zero_counts = self._encoder() - value
        else:
            self._memory.store(name, value, self._names)
            self._find_identifiers()

    def _set_mode(self, value: int) -> None:
        if value in tuple(Mode):
            self.mode, self.torque_units = Mode(value), 0

    def _set_torque(self, decoded: DecodedFrame) -> None:
        packed = decoded.torques
        place = self._memory.value("PIDX") - 1
        value = packed[place] if packed and 0 <= place < len(packed) else decoded.value
        if self.mode is Mode.TORQUE and value is not None:
            largest = self._memory.value("MT")
            self.torque_units = max(-largest, min(largest, value))


def _factory_values(facts: PuckFacts, has_joint_encoder: bool) -> dict[str, int]:
    """EEPROM of an arm as it may be found: the wrist still has the groups of the 2008 manual."""
    lower = facts.node <= _LOWER_ARM
    return {
        "VERS": facts.version,
        "ROLE": _MAGNETIC_ENCODER | (_JOINT_ENCODER if has_joint_encoder else 0),
        "SN": 1000 + facts.node,
        "ID": facts.node,
        "GRPB": 1 if lower else 2,
        "GRPC": 4 if lower else 5,
        "PIDX": facts.node if lower else facts.node - _LOWER_ARM,
        "JIDX": facts.node,
        "CTS": facts.counts,
        "IPNM": facts.units_per_nm,
        "POLES": facts.poles,
        "MT": _LARGEST_TORQUE,
        "TEMP": _BOARD_C,
        "THERM": _BOARD_C,
        "OTEMP": 60,
        "VBUS": _SUPPLY_V,
    }
