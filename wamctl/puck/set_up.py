"""Bringing the motor Pucks from the unknown to a checked, torque-free state."""

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from wamctl.arm.config import ArmFile, PuckDrivesSection
from wamctl.errors import BusError
from wamctl.puck.enumerations import JOINT_ENCODER, MotorMode, Role, Status
from wamctl.puck.exchange import Exchange
from wamctl.puck.properties import SAFE_ON_EVERY_VERSION, Properties, motor_properties
from wamctl.puck.wiring import memberships, torque_place

PROBE_GAP_S = 0.001
PROBE_PATIENCE_S = 0.05
WAKE_GAP_S = 0.010
WAKE_SILENCE_S = 1.0
"""Nobody may speak while the Pucks' transceivers come online: it can drive the bus off."""

ROLE_MASK = 0x1F
ZERO_TOLERANCE_COUNTS = 20
"""By so much may an arm move between the declaration of its position and the question for it."""

_STAT, _VERS, _ROLE = (SAFE_ON_EVERY_VERSION[name] for name in ("STAT", "VERS", "ROLE"))


@dataclass(frozen=True)
class Expected:
    """What the configuration says about one motor Puck.

    Attributes:
        node: node id.
        version: VERS.
        counts: CTS.
        units_per_nm: IPNM.
        poles: POLES, which firmware before 44 does not tell.
        has_joint_encoder: whether its positions have six bytes.
        settings: what to set, by the property's name.
    """

    node: int
    version: int
    counts: int
    units_per_nm: int
    poles: int
    has_joint_encoder: bool
    settings: dict[str, int]


def expected(arm: ArmFile, drives: PuckDrivesSection, slot: int) -> Expected:
    """What to expect of the Puck at a place (0, 1, ...) in the configuration, and what to set."""
    units_per_nm = drives.torque_units_per_nm[slot]
    largest = int(arm.limits.motor_torque_nm[slot] * units_per_nm)
    return Expected(
        drives.node_ids[slot],
        drives.firmware[slot],
        drives.counts_per_revolution[slot],
        units_per_nm,
        drives.poles[slot],
        drives.joint_encoder_counts[slot] > 0,
        {**memberships(slot), "PIDX": torque_place(slot), "MT": largest},
    )


def asleep(exchange: Exchange, nodes: Iterable[int]) -> list[int]:
    """Nodes whose monitor runs.

    Raises:
        BusError: one of them does not answer.
    """
    return [n for n in nodes if exchange.ask(n, _STAT, "STAT") == Status.RESET]


def wake(exchange: Exchange, nodes: list[int]) -> None:
    """Start the firmware of Pucks whose monitor runs, and keep silent while they come online."""
    for node in nodes:
        exchange.tell(node, _STAT, Status.READY)
        time.sleep(WAKE_GAP_S)
    if nodes:
        time.sleep(WAKE_SILENCE_S)


def identify(exchange: Exchange, wanted: Expected) -> Properties:
    """Compare a Puck with what is expected; returns the properties of its firmware.

    Raises:
        BusError: it does not answer, or differs; the message lists all differences.
    """
    version = exchange.ask(wanted.node, _VERS, "VERS")
    properties = motor_properties(version)
    differences = list(_differences(exchange, wanted, properties))
    if differences:
        raise BusError("; ".join(differences))
    return properties


def configure(exchange: Exchange, wanted: Expected, properties: Properties) -> None:
    """Take its torque away, then set its groups, its place in the torque frame and its limit.

    Raises:
        BusError: a setting did not stick.
    """
    exchange.establish(wanted.node, properties, {"MODE": MotorMode.IDLE, **wanted.settings})


def verify(exchange: Exchange, wanted: Expected, properties: Properties) -> None:
    """See whether a configured Puck still has its settings and gives no torque.

    Raises:
        BusError: it does not answer, or says another value, as after a restart.
    """
    for name, value in {"MODE": MotorMode.IDLE, **wanted.settings}.items():
        found = exchange.ask(wanted.node, properties[name], name)
        if found != value:
            raise BusError(
                f"has lost its settings since its set-up: {name} = {found} instead of {value:d}, "
                "as after a restart"
            )


def _differences(exchange: Exchange, wanted: Expected, properties: Properties) -> Iterator[str]:
    node = wanted.node
    status = exchange.ask(node, _STAT, "STAT")
    if status != Status.READY:
        yield f"says STAT = {status} instead of {Status.READY.value} (ready)"
        return
    role = exchange.ask(node, _ROLE, "ROLE")
    if role & ROLE_MASK != Role.TATER:
        yield f"has the role {_role_word(role)}, not that of an arm's motor (0)"
        return
    if properties.version != wanted.version:
        yield (
            f"has firmware {properties.version}; drives.firmware in the configuration "
            f"says {wanted.version}"
        )
    if bool(role & JOINT_ENCODER) != wanted.has_joint_encoder:
        has, says = ("a", "none") if not wanted.has_joint_encoder else ("no", "one")
        yield f"has {has} joint encoder (ROLE {role:#06x}); the configuration says {says}"
    for name, value, effect in (
        ("CTS", wanted.counts, "every angle would be wrong by their ratio"),
        ("IPNM", wanted.units_per_nm, "every torque would be wrong by their ratio"),
        ("POLES", wanted.poles, "it drives another motor than that"),
    ):
        if name not in properties.ids():
            continue
        found = exchange.ask(node, properties[name], name)
        if found != value:
            yield f"says {name} = {found}; the configuration says {value}: {effect}"


def _role_word(role: int) -> str:
    kind = role & ROLE_MASK
    return f"{kind} ({Role(kind).name.lower()})" if kind in tuple(Role) else f"{kind}"
