"""From a word for a bus to its hub."""

from pathlib import Path

from sim_bus.can_bus.hub import Hub
from sim_bus.can_bus.kernel_hub import KernelHub
from sim_bus.can_bus.python_can_hub import PythonCanHub
from sim_bus.can_bus.socket_hub import SocketHub
from sim_bus.errors import SimulatedBusError


def open_hub(bus: str, fd: bool) -> Hub:
    """The hub for `simbus:PATH`, or for `INTERFACE:CHANNEL` in python-can's words.

    Args:
        bus: its name.
        fd: whether CAN FD frames are wanted.

    Raises:
        SimulatedBusError: no such bus.
    """
    interface, separator, channel = bus.partition(":")
    if not separator or not channel:
        raise SimulatedBusError(
            f"sim-bus got the bus {bus!r}: name it as INTERFACE:CHANNEL, such as simbus:/tmp/arm "
            "or socketcan:vcan0."
        )
    if interface == "simbus":
        return SocketHub(Path(channel))
    if interface == "socketcan":
        return KernelHub(channel, fd)
    return PythonCanHub(interface, channel, fd)
