"""Questions and settings on a quiet bus, one Puck at a time: for set-up, not for the cycle."""

import time
from collections.abc import Callable, Iterator, Mapping

import can

from wamctl.drives.bus import heard_within
from wamctl.errors import BusError, SilentDriveError
from wamctl.puck import frames
from wamctl.puck.properties import SAFE_ON_EVERY_VERSION, Properties
from wamctl.puck.wiring import is_plain, message, position_reply, property_reply

ATTEMPTS = 5
PATIENCE_S = 0.05
_SETTINGS = 3


class Exchange:
    """Talk with single Pucks.

    Args:
        bus: the open bus, which nobody else reads meanwhile.
    """

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus

    def ask(self, node: int, property_id: int, what: str) -> int:
        """The value of a property.

        Args:
            node: the Puck.
            property_id: the property's number in its firmware.
            what: the property's name, for messages.

        Raises:
            BusError: no answer, or a wrong one; the message is the end of a sentence.
        """
        own = frames.SET_BIT | property_id  # a late answer to an earlier question is passed over
        return frames.decode_reply(
            property_id,
            self._answer(
                node,
                property_id,
                what,
                lambda f: f.arbitration_id == property_reply(node) and f.data[:1] == bytes((own,)),
            ),
        )

    def position(self, node: int, property_id: int) -> tuple[int, ...]:
        """Position of the motor, and of the joint encoder where there is one [counts].

        Raises:
            BusError: no answer, or a wrong one.
        """
        reply = position_reply(node)
        return frames.decode_positions(
            self._answer(node, property_id, "P", lambda f: f.arbitration_id == reply)
        )

    def tell(self, node: int, property_id: int, value: int) -> None:
        """Set a property, which no Puck acknowledges.

        Raises:
            BusError: the bus does not send.
        """
        self._send(frames.to_node(node), frames.encode_set(property_id, value))

    def establish(
        self, node: int, properties: Properties, values: Mapping[str, int], gap_s: float = 0.0
    ) -> None:
        """Set properties and read each of them back, so that no receive buffer can overflow.

        Args:
            node: the Puck.
            properties: of its firmware.
            values: what to set, by name.
            gap_s: quiet time before each setting [s], for one that drops what comes sooner: a bus
                may bring two settings closer together, so that one that was dropped is sent again.

        Raises:
            BusError: no answer, or a value that did not stick.
        """
        for name, value in values.items():
            found = None
            for _ in range(_SETTINGS if gap_s else 1):
                time.sleep(gap_s)
                self.tell(node, properties[name], value)
                found = self._read_back(node, properties[name], name, value)
                if found == value:
                    break
            else:
                raise BusError(f"says {name} = {found} after it was set to {value}")

    def _read_back(self, node: int, property_id: int, what: str, value: int) -> int:
        """A property that was set; late answers to earlier questions say what it was before."""
        found = self.ask(node, property_id, what)
        for _ in range(ATTEMPTS - 1):
            if found == value:
                break
            found = self.ask(node, property_id, what)
        return found

    def census(self, gap_s: float, patience_s: float) -> set[int]:
        """Nodes that answer a question for STAT, which every Puck understands in every state.

        Args:
            gap_s: time between two questions [s].
            patience_s: time to wait for the last answers [s].
        """
        nodes = {property_reply(node): node for node in range(1, frames.NODE_MAX + 1)}
        found = set()
        for node in nodes.values():
            self._send(frames.to_node(node), frames.encode_get(SAFE_ON_EVERY_VERSION["STAT"]))
            found |= self._heard_within(gap_s)
        found |= self._heard_within(patience_s)
        return {nodes[identifier] for identifier in found & nodes.keys()}

    def _heard_within(self, duration_s: float) -> set[int]:
        """Identifiers of the frames that come in within a time."""
        return {frame.arbitration_id for frame in self._received(duration_s)}

    def _answer(
        self, node: int, property_id: int, what: str, is_it: Callable[[can.Message], bool]
    ) -> bytes:
        for _ in range(ATTEMPTS):
            self._send(frames.to_node(node), frames.encode_get(property_id))
            for frame in self._received(PATIENCE_S):
                if is_it(frame):
                    return bytes(frame.data)
        raise SilentDriveError(
            f"does not answer a question for {what} ({ATTEMPTS} times {PATIENCE_S * 1e3:.0f} ms)"
        )

    def _send(self, identifier: int, data: bytes) -> None:
        try:
            self._bus.send(message(identifier, data))
        except (can.CanError, OSError) as error:
            raise BusError(f"cannot be reached: the bus does not send ({error})") from error

    def _received(self, patience_s: float) -> Iterator[can.Message]:
        try:
            yield from filter(is_plain, heard_within(self._bus, patience_s))
        except (can.CanError, OSError) as error:
            raise BusError(f"cannot be heard: the bus does not receive ({error})") from error
