"""The PDOs of a drive in OPERATIONAL: which are due when, and which wait for the next SYNC."""

from sim_bus.canopen import pdo
from sim_bus.canopen.dictionary import ObjectDictionary
from sim_bus.canopen.pdo import LAST_SYNCHRONOUS, Pdo, Values

NEVER_NS = 1 << 62
_MS = 1_000_000


class ProcessData:
    """The PDOs that the object dictionary describes, while the drive is OPERATIONAL.

    Attributes:
        receiving: RPDOs; none outside OPERATIONAL.

    Args:
        objects: the drive's object dictionary.
        longest_bytes: of a PDO's data.
    """

    def __init__(self, objects: ObjectDictionary, longest_bytes: int) -> None:
        self._objects = objects
        self._longest_bytes = longest_bytes
        self.stop()

    def stop(self) -> None:
        """Leave OPERATIONAL: no PDOs."""
        self.receiving: list[Pdo] = []
        self._synchronous: list[Pdo] = []
        self._timed: list[Pdo] = []
        self._latched: dict[int, Values] = {}
        self._event_ns: dict[int, int] = {}
        self._syncs = 0

    def start(self, time_ns: int) -> None:
        """Enter OPERATIONAL: PDOs as the object dictionary has them by now."""
        transmitting = pdo.valid_pdos(
            self._objects, pdo.TPDO_PARAMETER, pdo.TPDO_MAPPING, self._longest_bytes
        )
        self.receiving = pdo.valid_pdos(
            self._objects, pdo.RPDO_PARAMETER, pdo.RPDO_MAPPING, self._longest_bytes
        )
        self._synchronous = [p for p in transmitting if p.kind <= LAST_SYNCHRONOUS]
        # A buffer of type 0 is applied at every SYNC, and holds zeros before its first frame.
        self._latched = {
            p.number: p.mapping.unpack(bytes(p.mapping.layout.size))
            for p in self.receiving
            if p.kind == 0
        }
        self._timed = [p for p in transmitting if p.kind > LAST_SYNCHRONOUS and p.event_ms]
        self._event_ns = {p.number: time_ns + p.event_ms * _MS for p in self._timed}

    @property
    def next_ns(self) -> int:
        """When the next event timer runs out."""
        return min(self._event_ns.values(), default=NEVER_NS)

    def timed_out(self, time_ns: int) -> list[Pdo]:
        """TPDOs whose event timer has run out; it starts again."""
        due = [p for p in self._timed if time_ns >= self._event_ns[p.number]]
        for p in due:
            self._event_ns[p.number] += p.event_ms * _MS
        return due

    def at_sync(self) -> list[Pdo]:
        """TPDOs that answer this SYNC."""
        self._syncs += 1
        return [p for p in self._synchronous if p.kind <= 1 or self._syncs % p.kind == 0]

    def latched(self) -> list[Values]:
        """Values that this SYNC makes effective; those of type 0 stay for the next one too."""
        waiting = [p for p in self.receiving if p.number in self._latched]
        return [
            self._latched[p.number] if p.kind == 0 else self._latched.pop(p.number) for p in waiting
        ]

    def receive(self, p: Pdo, data: bytes) -> Values | None:
        """Values of an RPDO that are effective at once; None where they wait for a SYNC."""
        values = p.mapping.unpack(data)
        if p.kind > LAST_SYNCHRONOUS:
            return values
        self._latched[p.number] = values
        return None
