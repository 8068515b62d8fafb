"""Bringing one drive from the unknown to a checked, silent, torque-free state (by SDO)."""

from collections.abc import Iterator
from dataclasses import dataclass

from wamctl.arm.config import ArmFile, CanopenDrivesSection
from wamctl.canopen import dictionary as od
from wamctl.canopen import ds402, emcy, pdo, sdo
from wamctl.canopen.ds402 import Controlword, State
from wamctl.errors import BusError


@dataclass(frozen=True)
class Expected:
    """What the configuration says about one drive.

    Attributes:
        vendor, product: identity, object 0x1018.
        rated_mnm: rated torque, object 0x6076 [mN m].
        settings: writes that give it its limits and PDOs, in order.
    """

    vendor: int
    product: int
    rated_mnm: int
    settings: tuple[tuple[od.Object, int], ...]


def expected(arm: ArmFile, drives: CanopenDrivesSection, slot: int) -> Expected:
    """What to expect of the drive at a place (0, 1, ...) in the configuration, and what to set."""
    rated, limit = drives.rated_torque_nm[slot], arm.limits.motor_torque_nm[slot]
    parameters = [
        (od.TARGET_TORQUE, 0),
        (od.MAX_TORQUE, round(1000 * limit / rated)),
        (od.MODE, ds402.TORQUE_MODE),
        (od.CYCLE_VALUE, round(arm.bus.period_s * 1e4)),
        (od.CYCLE_EXPONENT, -4),
        (od.HEARTBEAT_PRODUCER, drives.heartbeat_ms),
    ]
    mapping = pdo.settings(pdo.wiring(drives, slot), drives.node_ids[slot])
    return Expected(
        drives.identity.vendor,
        drives.identity.product,
        round(1000 * rated),
        (*parameters, *mapping),
    )


def identify(node: sdo.Node, wanted: Expected) -> list[str]:
    """Compare the drive with what is expected; returns every difference, as ends of sentences.

    Raises:
        BusError: it does not answer.
    """
    return [fault for fault in _differences(node, wanted) if fault]


def _differences(node: sdo.Node, wanted: Expected) -> Iterator[str]:
    profile = sdo.read(node, od.DEVICE_TYPE) & 0xFFFF
    if profile != od.SERVO_PROFILE:
        yield f"is a CiA {profile} device, not a drive (CiA {od.SERVO_PROFILE})"
        return
    identity = sdo.read(node, od.VENDOR), sdo.read(node, od.PRODUCT)
    if identity != (wanted.vendor, wanted.product):
        yield (
            f"says vendor {identity[0]:#x}, product {identity[1]:#x}; the configuration says "
            f"vendor {wanted.vendor:#x}, product {wanted.product:#x}"
        )
    if not sdo.read(node, od.SUPPORTED_MODES) & ds402.TORQUE_MODE_BIT:
        yield "has no cyclic synchronous torque mode (bit 9 of object 0x6502:0)"
    rated = sdo.read(node, od.RATED_TORQUE)
    if rated != wanted.rated_mnm:
        yield (
            f"says a rated torque of {rated} mN m (object 0x6076:0); the configuration says "
            f"{wanted.rated_mnm} mN m, and every torque would be wrong by their ratio"
        )


def reset_fault(node: sdo.Node) -> str | None:
    """Take an old fault away, ending at SWITCH ON DISABLED; returns what it was, None if none.

    Raises:
        BusError: the fault stays.
    """
    sdo.write(node, od.SYNC_LOSS, 0)
    sdo.write(node, od.CONTROLWORD, Controlword.DISABLE_VOLTAGE)
    if _state(node) not in ds402.FAULTY:
        return None
    code = sdo.read(node, od.ERROR_CODE)
    what = f"0x{code:04X} ({emcy.meaning(code)})"
    sdo.write(node, od.CONTROLWORD, Controlword.FAULT_RESET)
    sdo.write(node, od.CONTROLWORD, Controlword.DISABLE_VOLTAGE)
    if _state(node) is not State.SWITCH_ON_DISABLED:
        raise BusError(f"stays in fault {what} after a fault reset")
    return what


def configure(node: sdo.Node, wanted: Expected) -> None:
    """Write and read back all settings; the drive must be PRE-OPERATIONAL.

    Raises:
        BusError: a write was refused or did not stick.
    """
    for entry, value in wanted.settings:
        sdo.write(node, entry, value)
    mode = sdo.read(node, od.MODE_DISPLAY)
    if mode != ds402.TORQUE_MODE:
        raise BusError(f"shows mode {mode} instead of {ds402.TORQUE_MODE} (object 0x6061:0)")


def verify(node: sdo.Node, wanted: Expected) -> None:
    """See whether a configured drive still has its settings, and no fault.

    Raises:
        BusError: another value, as after a restart, or a fault.
    """
    state = _state(node)
    if state in ds402.FAULTY:
        code = sdo.read(node, od.ERROR_CODE)
        raise BusError(f"is in fault 0x{code:04X} ({emcy.meaning(code)}) since its set-up")
    for entry, value in dict(wanted.settings).items():
        found = sdo.read(node, entry)
        if found != value:
            raise BusError(
                f"has lost its settings since its set-up: object {entry} is {found:#x} instead of "
                f"{value:#x}, as after a restart"
            )


def _state(node: sdo.Node) -> State | None:
    return ds402.state(sdo.read(node, od.STATUSWORD))
