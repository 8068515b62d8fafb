"""Speed of the simulated arm: the ten-frame cycle in lockstep, against real time.

Run: .venv/bin/python scripts/benchmarks/simulated_arm.py [CYCLES]

A bare master sends SYNC, waits for seven positions and answers with two torque frames; the arm is
another process. The last line is a plain loop of this interpreter, which takes about 0.2 s on an
idle machine of the year 2022: on a busy one, read all figures relative to it.
"""

import struct
import sys
import tempfile
import time

import can
from served_arm import plain_loop, served

PERIOD_S = 0.002
NODES = range(1, 8)


def send(bus: can.BusABC, can_id: int, data: bytes = b"") -> None:
    """One frame."""
    bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))


def write(bus: can.BusABC, node: int, index: int, subindex: int, value: int, size: int) -> None:
    """Expedited SDO download."""
    data = value.to_bytes(size, "little").ljust(4, b"\0")
    send(bus, 0x600 + node, struct.pack("<BHB", 0x23 | (4 - size) << 2, index, subindex) + data)
    while (message := bus.recv(5.0)) is not None:
        if message.arbitration_id == 0x580 + node:
            return
    raise SystemExit(f"node {node} does not answer")


def map_pdo(bus: can.BusABC, node: int, parameter: int, cob_id: int, entries: list[int]) -> None:
    """The standard's order of re-mapping, type 1."""
    write(bus, node, parameter, 1, cob_id | 0x8000_0000, 4)
    write(bus, node, parameter + 0x200, 0, 0, 1)
    for k, entry in enumerate(entries, 1):
        write(bus, node, parameter + 0x200, k, entry, 4)
    write(bus, node, parameter + 0x200, 0, len(entries), 1)
    write(bus, node, parameter, 2, 1, 1)
    write(bus, node, parameter, 1, cob_id, 4)


def enable(bus: can.BusABC) -> None:
    """All drives to OPERATION ENABLED in torque mode."""
    for node in NODES:
        slots = [0x00030010] * 4
        slots[(node - 1) % 4] = 0x60710010
        write(bus, node, 0x1801, 1, 0xC0000280 + node, 4)
        map_pdo(bus, node, 0x1800, 0x40000180 + node, [0x60410010, 0x60640020])
        map_pdo(bus, node, 0x1400, 0x200 if node < 5 else 0x300, slots)
        write(bus, node, 0x6060, 0, 10, 1)
    send(bus, 0, b"\x01\x00")
    for word in (0x06, 0x07, 0x0F):
        for node in NODES:
            write(bus, node, 0x6040, 0, word, 2)


def cycle(bus: can.BusABC, torques: bytes) -> None:
    """SYNC, seven positions, two torque frames."""
    send(bus, 0x080)
    missing = set(range(0x181, 0x188))
    while missing:
        message = bus.recv(5.0)
        if message is None:
            raise SystemExit(f"{len(missing)} positions are missing")
        missing.discard(message.arbitration_id)
    send(bus, 0x200, torques)
    send(bus, 0x300, torques)


def main() -> None:
    """Print the figures."""
    cycles = int(sys.argv[1]) if len(sys.argv) > 1 else 5000
    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/bus"
        with (
            served("wam7.yaml", f"simbus:{path}", "--lockstep") as (_, ready),
            can.Bus(interface="simbus", channel=path) as bus,
        ):
            sys.stdout.write(f"{ready}\n")
            enable(bus)
            torques = struct.pack("<4h", 100, -100, 50, 0)
            began = time.perf_counter()
            for _ in range(cycles):
                cycle(bus, torques)
            seconds = time.perf_counter() - began
    micros = seconds / cycles * 1e6
    ratio = cycles * PERIOD_S / seconds
    sys.stdout.write(f"{cycles} cycles: {micros:.0f} us each, {ratio:.1f} times real time\n")
    sys.stdout.write(plain_loop())


if __name__ == "__main__":
    main()
