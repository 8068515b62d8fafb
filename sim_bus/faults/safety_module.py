"""What a fault does to the safety module of a classic arm, and to the pendant."""

from sim_bus.faults.script import LostZero, OnSafetyModule, PendantPressed, SafetyFault
from sim_bus.frame import Frame
from sim_bus.safety_module import Lamp, Press
from sim_bus.safety_node import SafetyNode


def befall(fault: OnSafetyModule, node: SafetyNode, time_ns: int) -> list[Frame]:
    """Let it happen; the frames that the module sends for it."""
    match fault:
        case PendantPressed():
            return node.press(Press[fault.button.upper()], time_ns)
        case SafetyFault():
            return node.fail(Lamp[fault.light.upper()], time_ns)
        case LostZero():
            node.module.lose_zero()
    return []
