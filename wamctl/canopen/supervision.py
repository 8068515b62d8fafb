"""What the drives say outside the cycle: emergencies, heartbeats, restarts (CiA 301)."""

from collections.abc import Sequence

from wamctl.canopen import identifiers as ids
from wamctl.canopen.emcy import Emergency, emergency

_OPERATIONAL = 5
_BOOT_UP = 0
_NMT_STATES = {0: "BOOT-UP", 4: "STOPPED", 5: "OPERATIONAL", 127: "PRE-OPERATIONAL"}
_HEARTBEATS_MISSED = 3


class Supervision:
    """Watches n drives by their emergencies and heartbeats.

    Args:
        node_ids: node of each drive.
        names: what to call each drive.
        heartbeat_s: interval of their heartbeats [s].
    """

    def __init__(self, node_ids: Sequence[int], names: Sequence[str], heartbeat_s: float) -> None:
        self.emergencies: list[tuple[str, Emergency]] = []
        self._slots = {node: slot for slot, node in enumerate(node_ids)}
        self._names = names
        self._patience_s = _HEARTBEATS_MISSED * heartbeat_s
        self._heard_s = [0.0] * len(node_ids)
        self._started = [False] * len(node_ids)
        self._fault: str | None = None

    def start(self, now_s: float) -> None:
        """Every drive counts as heard of now; what was said before is forgotten."""
        self._heard_s = [now_s] * len(self._heard_s)
        self._started = [False] * len(self._heard_s)
        self._fault = None
        self.emergencies.clear()

    def hear(self, can_id: int, data: bytes | bytearray, now_s: float) -> bool:
        """Take in a frame; False if it is none of an emergency or heartbeat of these drives."""
        slot = self._slots.get(can_id & ids.NODE)
        if slot is None:
            return False
        if can_id & ids.SERVICE == ids.EMERGENCY:
            return self._hear_emergency(slot, data)
        if can_id & ids.SERVICE == ids.HEARTBEAT and len(data) == 1:
            self._hear_heartbeat(slot, data[0] & 0x7F, now_s)
            return True
        return False

    def fault(self, now_s: float) -> str | None:
        """The first fault since the start; None while all is well."""
        if self._fault is None and now_s - min(self._heard_s) > self._patience_s:
            slot = self._heard_s.index(min(self._heard_s))
            silence = now_s - self._heard_s[slot]
            self._note(
                slot, f"sent no heartbeat for {silence:.3f} s (limit {self._patience_s:.3f} s)"
            )
        return self._fault

    def _hear_heartbeat(self, slot: int, state: int, now_s: float) -> None:
        if state == _OPERATIONAL:
            self._heard_s[slot] = now_s
            self._started[slot] = True
        elif state == _BOOT_UP or self._started[slot]:  # before, it may be one from the set-up
            self._note(slot, _left_operational(state))

    def _hear_emergency(self, slot: int, data: bytes | bytearray) -> bool:
        heard = emergency(data)
        if heard is None:
            return False
        self.emergencies.append((self._names[slot], heard))
        if heard.code >> 8 != 0:
            self._note(slot, f"reported {heard}")
        return True

    def _note(self, slot: int, what: str) -> None:
        self._fault = self._fault or f"{self._names[slot]} {what}"


def _left_operational(state: int) -> str:
    if state == _BOOT_UP:
        return "started anew (boot-up message)"
    return f"left OPERATIONAL for NMT state {_NMT_STATES.get(state, state)}"
