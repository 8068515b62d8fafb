"""The safety module (node 10) before the cycle: its identity, its limits, its state."""

import time
from collections.abc import Callable

from wamctl.arm.config import SafetyModuleSection
from wamctl.errors import BusError
from wamctl.puck.enumerations import Role, SafetyMode
from wamctl.puck.exchange import Exchange
from wamctl.puck.pendant import Light, decode_pendant
from wamctl.puck.properties import SAFE_ON_EVERY_VERSION, Properties
from wamctl.puck.set_up import ROLE_MASK

Step = Callable[[Exchange, SafetyModuleSection, Properties], str]

GAP_S = 0.011
"""Between two settings; the module needs 10 ms (Barrett wiki, SafetyFeaturesPrecautions)."""
SPEED_UNITS = 4096
"""VL1 and VL2 are Q4.12 numbers [m/s]."""
IGNORED_SAMPLES = 5
"""IFAULT at the start of a cycle: the length of the module's history (libbarrett)."""


def limits(section: SafetyModuleSection) -> dict[str, int]:
    """The module's limits as its properties hold them."""
    return {
        "TL1": section.torque_warning_units,
        "TL2": section.torque_fault_units,
        "VL1": round(section.speed_warning_m_s * SPEED_UNITS),
        "VL2": round(section.speed_fault_m_s * SPEED_UNITS),
    }


def identify(exchange: Exchange, section: SafetyModuleSection, properties: Properties) -> str:
    """Compare the module with what is expected; returns an empty note.

    Raises:
        BusError: it does not answer, differs, or is in E-STOP.
    """
    node = section.node_id
    version = exchange.ask(node, SAFE_ON_EVERY_VERSION["VERS"], "VERS")
    role = exchange.ask(node, SAFE_ON_EVERY_VERSION["ROLE"], "ROLE") & ROLE_MASK
    if role != Role.SAFETY:
        raise BusError(f"has the role {role}, not that of a safety module ({Role.SAFETY.value})")
    if version != section.firmware:
        raise BusError(
            f"has firmware {version}; drives.safety_module.firmware in the configuration says "
            f"{section.firmware}"
        )
    if exchange.ask(node, properties["MODE"], "MODE") == SafetyMode.ESTOP:
        raise BusError(
            "is in E-STOP, so that no Puck has power: release the E-STOP button and press "
            "Shift-Idle on the pendant"
        )
    return ""


def configure(exchange: Exchange, section: SafetyModuleSection, properties: Properties) -> str:
    """Idle the arm and set the limits; returns a note for the operator, empty for none.

    Raises:
        BusError: a setting did not stick.
    """
    node = section.node_id
    settings = {"MODE": SafetyMode.IDLE, **limits(section)}
    exchange.establish(node, properties, settings, GAP_S)
    pendant = decode_pendant(exchange.ask(node, properties["PEN"], "PEN"))
    faults = pendant.lit(Light.FAULT)
    if not faults:
        return ""
    return (
        f"the pendant shows a fault ({', '.join(faults)}): press Shift-Idle before Shift-Activate"
    )


def check_zero(exchange: Exchange, section: SafetyModuleSection, properties: Properties) -> str:
    """Make sure that the Pucks' positions are defined; returns an empty note.

    Raises:
        BusError: they are not.
    """
    if exchange.ask(section.node_id, properties["ZERO"], "ZERO") != 1:
        raise BusError(
            "says ZERO = 0, so that no position can be trusted since power was switched on: "
            "put the arm into its home pose and run `wamctl home`"
        )
    return ""


def verify(exchange: Exchange, section: SafetyModuleSection, properties: Properties) -> str:
    """See whether the module still has its limits, its zero, and gives no torque; an empty note.

    Raises:
        BusError: it does not answer, or says another value.
    """
    for name, value in {"MODE": SafetyMode.IDLE, **limits(section)}.items():
        found = exchange.ask(section.node_id, properties[name], name)
        if found != value:
            raise BusError(
                f"has lost its settings since its set-up: {name} = {found} instead of {value:d}"
            )
    return check_zero(exchange, section, properties)


def declare_zero(exchange: Exchange, section: SafetyModuleSection, properties: Properties) -> str:
    """Tell the module that positions are defined, so that it watches speeds; an empty note.

    Raises:
        BusError: it does not take it.
    """
    time.sleep(GAP_S)
    exchange.tell(section.node_id, properties["IFAULT"], IGNORED_SAMPLES)
    exchange.establish(section.node_id, properties, {"ZERO": 1}, GAP_S)
    return ""
