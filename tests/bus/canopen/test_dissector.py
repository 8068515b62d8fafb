"""A whole experiment's traffic through Wireshark's CANopen dissector, which we did not write."""

import shutil
import struct
import subprocess
from collections import Counter
from pathlib import Path

import can
import pytest

from tests.bus.buses import on_embedded_bus

TSHARK = shutil.which("tshark")
SOCKETCAN_LINK = 227

pytestmark = pytest.mark.skipif(TSHARK is None, reason="tshark is not installed")


class Tap(can.Listener):
    """Keeps every frame."""

    def __init__(self) -> None:
        self.frames: list[can.Message] = []

    def on_message_received(self, msg: can.Message) -> None:
        self.frames.append(msg)


def write_capture(path: Path, frames: list[can.Message]) -> None:
    """A capture file: SocketCAN frames, identifiers in network order."""
    with path.open("wb") as file:
        file.write(struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, SOCKETCAN_LINK))
        for k, frame in enumerate(frames):
            packet = struct.pack(">IB3x", frame.arbitration_id, frame.dlc) + bytes(frame.data)
            file.write(struct.pack("<IIII", k // 1000, k % 1000, len(packet), len(packet)))
            file.write(packet)


def dissected(path: Path, *fields: str, only: str = "") -> list[list[str]]:
    """The fields of each frame."""
    assert TSHARK is not None
    chosen = [word for field in fields for word in ("-e", field)]
    command = [TSHARK, "-r", str(path), "-d", "can.subdissector,canopen", "-T", "fields", *chosen]
    done = subprocess.run(
        [*command, "-Y", only] if only else command, capture_output=True, text=True, check=True
    )
    return [line.split("\t") for line in done.stdout.splitlines()]


@on_embedded_bus("word")
def test_a_whole_experiment_has_no_malformed_frame(serve_arms, tmp_path):
    tap, capture = Tap(), tmp_path / "experiment.pcap"
    with serve_arms() as arm:
        interface, channel = arm.word.split(":", 1)
        with can.Bus(interface=interface, channel=channel) as bus:
            notifier = can.Notifier(bus, [tap])
            done = arm.excite()
            notifier.stop()
    assert done.error is None
    write_capture(capture, tap.frames)
    assert dissected(capture, "frame.number", only="_ws.malformed || _ws.expert") == []
    rows = dissected(capture, "can.id", "_ws.col.Protocol")
    assert len(rows) == len(tap.frames) > 10_000
    assert {protocol for _, protocol in rows} == {"CANopen"}
    kinds = Counter(int(identifier) & 0x780 for identifier, _ in rows)
    assert kinds[0x080] > 1000
    assert kinds[0x180] > 1000
    assert kinds[0x600] == kinds[0x580] > 100
