"""Faults of a classic arm's safety module and pendant."""

from sim_bus.can_bus.frame import Frame
from sim_bus.faults.script import LostZero, OnSafetyModule, PendantPressed, SafetyFault
from sim_bus.puck.safety_module import Lamp, Press
from sim_bus.puck.safety_node import SafetyNode


def apply_fault(fault: OnSafetyModule, node: SafetyNode, time_ns: int) -> list[Frame]:
    """Apply a fault: the frames that the module sends for it."""
    match fault:
        case PendantPressed():
            return node.press(Press[fault.button.upper()], time_ns)
        case SafetyFault():
            return node.fail(Lamp[fault.light.upper()], time_ns)
        case LostZero():
            node.module.lose_zero()
    return []
