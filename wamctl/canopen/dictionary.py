"""The objects of the drives' dictionary that the master reads and writes (CiA 301 and CiA 402)."""

import configparser
from dataclasses import dataclass
from pathlib import Path

from canopen import ObjectDictionary
from canopen.objectdictionary import import_od

from wamctl.arm.errors import ConfigurationError


@dataclass(frozen=True)
class Object:
    """Address of an entry, with its length where it is mapped into a PDO."""

    index: int
    subindex: int = 0
    bits: int = 0

    def __str__(self) -> str:
        return f"0x{self.index:04X}:{self.subindex}"

    @property
    def mapping(self) -> int:
        """The entry as a PDO mapping parameter holds it."""
        return self.index << 16 | self.subindex << 8 | self.bits


DEVICE_TYPE = Object(0x1000)
HEARTBEAT_PRODUCER = Object(0x1017)
VENDOR = Object(0x1018, 1)
PRODUCT = Object(0x1018, 2)
SYNC_LOSS = Object(0x2406)
AMPLIFIER_TEMPERATURE = Object(0x3000, 2, 16)
MOTOR_TEMPERATURE = Object(0x3010, 3, 16)
ERROR_CODE = Object(0x603F, 0, 16)
CONTROLWORD = Object(0x6040, 0, 16)
STATUSWORD = Object(0x6041, 0, 16)
MODE = Object(0x6060, 0, 8)
MODE_DISPLAY = Object(0x6061, 0, 8)
POSITION = Object(0x6064, 0, 32)
TARGET_TORQUE = Object(0x6071, 0, 16)
MAX_TORQUE = Object(0x6072, 0, 16)
RATED_TORQUE = Object(0x6076, 0, 32)
CYCLE_VALUE = Object(0x60C2, 1)
CYCLE_EXPONENT = Object(0x60C2, 2)
DIGITAL_INPUTS = Object(0x60FD, 0, 32)
SUPPORTED_MODES = Object(0x6502)
DUMMY_I16 = Object(0x0003, 0, 16)

SERVO_PROFILE = 402


def load_dictionary(path: Path, node_id: int) -> ObjectDictionary:
    """The drive's EDS file, for one node.

    Raises:
        ConfigurationError: missing or unreadable file, or one that lacks what a torque loop needs.
    """
    try:
        dictionary = import_od(str(path), node_id)
    except (OSError, ValueError, configparser.Error) as error:
        raise ConfigurationError(path, [f"not a readable EDS file ({error})"]) from error
    needed = (DEVICE_TYPE, VENDOR, PRODUCT, CONTROLWORD, STATUSWORD, MODE, POSITION, TARGET_TORQUE)
    missing = [str(o) for o in needed if not has(dictionary, o)]
    if missing:
        raise ConfigurationError(
            path, [f"the dictionary has no {', '.join(missing)}, without which there is no torque"]
        )
    return dictionary


def has(dictionary: ObjectDictionary, wanted: Object) -> bool:
    """Whether the dictionary lists an object."""
    return dictionary.get_variable(wanted.index, wanted.subindex) is not None
