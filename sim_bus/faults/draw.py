"""Faults by chance."""

from collections.abc import Sequence

import numpy as np

from sim_bus.faults.script import FaultScript, RandomFaults
from wamctl.arm.config import validate

_SYNC, _GROUPS = 0x080, (0x200, 0x300)
_CODES = (0x2310, 0x2320, 0x3210, 0x4210, 0x4310, 0x7122, 0x7320, 0x8611)
_LASTING = ("under_voltage", "silent_drive", "dead_drive", "bus_off", "stuck_encoder")
_LONGEST_CYCLES = 100
_LATEST_MS = 10.0
_LARGEST_JUMP_COUNTS = 4000


def drawn_faults(settings: RandomFaults, nodes: Sequence[int], seed: int) -> FaultScript:
    """The faults that a seed gives, as a script.

    Args:
        settings: how many, which, and when.
        nodes: node ids of the drives.
        seed: of chance.
    """
    random = np.random.default_rng([seed, 0xFA])
    faults = [_drawn(settings, nodes, random) for _ in range(settings.number)]
    return validate(FaultScript, {"faults": faults}, "random faults")


def _drawn(
    settings: RandomFaults, nodes: Sequence[int], random: np.random.Generator
) -> dict[str, object]:
    kind = str(random.choice(settings.faults))
    node = int(random.choice(list(nodes)))
    fault: dict[str, object] = {
        "fault": kind,
        "after": settings.after,
        "cycles": int(random.integers(settings.from_cycle, settings.to_cycle, endpoint=True)),
    }
    if kind.endswith("_frames"):
        identifiers = [_SYNC, *_GROUPS, *(0x180 + n for n in nodes)]
        fault |= {"id": int(random.choice(identifiers)), "number": int(random.integers(1, 20))}
    else:
        fault["node"] = node
    if kind == "late_frames":
        fault["late_ms"] = float(random.uniform(0.1, _LATEST_MS))
    elif kind in ("drive_fault", "emergency"):
        fault["code"] = int(random.choice(_CODES))
    elif kind == "encoder_jump":
        fault["counts"] = int(random.integers(-_LARGEST_JUMP_COUNTS, _LARGEST_JUMP_COUNTS))
    elif kind in _LASTING:
        fault["for_cycles"] = int(random.integers(1, _LONGEST_CYCLES))
    return fault
