"""Service data: reading and checked writing of a drive's objects (CiA 301, SDO)."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

import can
import canopen
from canopen.objectdictionary import ODVariable
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from wamctl.canopen import identifiers as ids
from wamctl.canopen.dictionary import Object
from wamctl.errors import BusError, SilentDriveError

_ATTEMPTS = 3
_POLL_S = 0.02
_LENGTHS = {
    ids.EMERGENCY: (0, 8),  # or SYNC
    ids.SDO_ANSWER: (8,),
    ids.SDO_REQUEST: (8,),
    ids.HEARTBEAT: (1,),
}


def add_node(
    network: canopen.Network, node_id: int, dictionary: canopen.ObjectDictionary
) -> canopen.RemoteNode:
    """A drive of the network whose SDO client asks several times."""
    node = canopen.RemoteNode(node_id, dictionary)
    node.sdo.MAX_RETRIES = _ATTEMPTS  # pyright: ignore[reportAttributeAccessIssue]
    return network.add_node(node)


@contextmanager
def listening(bus: can.BusABC, network: canopen.Network) -> Iterator[None]:
    """Give the bus's frames to the network, from another thread, until the block is left.

    Nobody else may receive meanwhile. A bus that fails ends the thread; the waiting SDO times out.
    """
    done = threading.Event()

    def feed() -> None:
        while not done.is_set():
            try:
                message = bus.recv(_POLL_S)
            except can.CanError:
                return
            if message is not None and is_plain(message):
                network.notify(message.arbitration_id, message.data, message.timestamp)

    thread = threading.Thread(target=feed, name="sdo", daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def is_data(message: can.Message) -> bool:
    """A data frame with an 11-bit identifier."""
    return not (message.is_extended_id or message.is_remote_frame or message.is_error_frame)


def is_plain(message: can.Message) -> bool:
    """A data frame with an 11-bit identifier and a length that its service allows."""
    if not is_data(message):
        return False
    lengths = _LENGTHS.get(message.arbitration_id & ids.SERVICE)
    return lengths is None or len(message.data) in lengths


def read(node: canopen.RemoteNode, wanted: Object) -> int:
    """The value of an object.

    Raises:
        BusError: no answer, or an abort; the message says which object and why.
    """
    variable = _variable(node, wanted)
    with _explained(node, wanted):
        data = node.sdo.upload(wanted.index, wanted.subindex)
    length = len(variable) // 8
    if len(data) < length:
        raise BusError(f"object {wanted} came with {len(data)} bytes instead of {length}")
    return int(variable.decode_raw(data[:length]))


def write(node: canopen.RemoteNode, wanted: Object, value: int) -> None:
    """Set an object and read it back.

    Raises:
        BusError: as for `read`, or the drive kept another value.
    """
    with _explained(node, wanted):
        node.sdo.download(wanted.index, wanted.subindex, _variable(node, wanted).encode_raw(value))
    kept = read(node, wanted)
    if kept != value:
        raise BusError(f"object {wanted} was set to {value:#x} and reads back as {kept:#x}")


def _variable(node: canopen.RemoteNode, wanted: Object) -> ODVariable:
    found = node.object_dictionary.get_variable(wanted.index, wanted.subindex)
    if found is None:
        raise BusError(f"object {wanted} is not in the drive's dictionary file")
    return found


@contextmanager
def _explained(node: canopen.RemoteNode, wanted: Object) -> Iterator[None]:
    try:
        yield
    except SdoAbortedError as error:
        raise BusError(f"object {wanted} was refused ({error})") from error
    except SdoCommunicationError as error:
        timeout = node.sdo.RESPONSE_TIMEOUT
        raise SilentDriveError(
            f"no answer about object {wanted} within {timeout:g} s, {_ATTEMPTS} times ({error})"
        ) from error
    except can.CanError as error:
        raise BusError(f"the question about object {wanted} could not be sent ({error})") from error
