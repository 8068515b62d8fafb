import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import can
import pytest

from sim_bus.assembly import load_simulation
from sim_bus.can_bus.frame import Frame
from sim_bus.can_bus.hub import Hub
from sim_bus.can_bus.socket_hub import SocketHub
from sim_bus.canopen.dictionary import Abort, Description, read_description
from sim_bus.canopen.drive import CanopenDrive, DriveSettings
from sim_bus.server import Lockstep, RealTime
from tests.bus.serving import served_by_thread
from wamctl.arm.config import shipped_file


@contextmanager
def served(hub: Hub, *, lockstep: bool, seed: int = 0) -> Iterator[None]:
    """A simulated WAM on a hub, served by a thread of this process."""
    simulation = load_simulation("wam7.yaml", seed)
    simulation.arm.plant.warm_up()
    service = (
        Lockstep(simulation.arm, hub, simulation.period_ns, simulation.schedule)
        if lockstep
        else RealTime(simulation.arm, hub, simulation.timing)
    )
    with served_by_thread(service, hub):
        yield


@pytest.fixture
def real_time_bus(tmp_path: Path) -> Iterator[str]:
    with served(SocketHub(tmp_path / "bus"), lockstep=False):
        yield str(tmp_path / "bus")


@pytest.fixture
def lockstep_bus(tmp_path: Path) -> Iterator[str]:
    with served(SocketHub(tmp_path / "bus"), lockstep=True):
        yield str(tmp_path / "bus")


@pytest.fixture
def serving():
    """The context manager `served`, for tests with a bus of their own."""
    return served


class Bench:
    """One drive on a bench, with a hand on its encoder and a master's few words."""

    def __init__(self, description: Description) -> None:
        self.node = 3
        self.now_ns = 0
        self.encoder = (0, 0)
        self.frames: list[Frame] = []
        settings = DriveSettings(self.node, 1490, 77)
        self.drive = CanopenDrive(
            description, settings, lambda: self.encoder[0], lambda: self.encoder[1]
        )
        self.frames += self.drive.boot(0)

    def send(self, can_id: int, data: bytes = b"") -> list[Frame]:
        """The drive's answers to a frame."""
        return self.drive.receive(self.now_ns, Frame(can_id, data))

    def wait(self, milliseconds: float) -> list[Frame]:
        """What the drive sends by itself meanwhile."""
        end = self.now_ns + round(milliseconds * 1e6)
        frames = []
        while self.drive.next_ns <= end:
            self.now_ns = max(self.now_ns, self.drive.next_ns)
            frames += self.drive.tick(self.now_ns)
        self.now_ns = end
        return frames

    def write(self, index: int, subindex: int, value: int, size: int) -> Abort | None:
        """Expedited download; the abort code, or None."""
        data = (value & (1 << 8 * size) - 1).to_bytes(size, "little").ljust(4, b"\0")
        head = struct.pack("<BHB", 0x23 | (4 - size) << 2, index, subindex)
        answers = self.send(0x600 + self.node, head + data)
        (response,) = [f.data for f in answers if f.can_id == 0x580 + self.node]
        self.frames += [f for f in answers if f.can_id != 0x580 + self.node]
        assert response[1:4] == head[1:4]
        if response[0] == 0x80:
            return Abort(struct.unpack_from("<I", response, 4)[0])
        assert response == struct.pack("<BHB4x", 0x60, index, subindex)
        return None

    def read(self, index: int, subindex: int = 0) -> int:
        """Expedited upload of an unsigned number."""
        request = struct.pack("<BHB4x", 0x40, index, subindex)
        (response,) = self.send(0x600 + self.node, request)
        assert response.data[0] & 0xE3 == 0x43
        size = 4 - (response.data[0] >> 2 & 3)
        return int.from_bytes(response.data[4 : 4 + size], "little")

    def map_pdo(
        self, parameter: int, cob_id: int, entries: list[int], kind: int
    ) -> list[Abort | None]:
        """The standard's order of re-mapping; the answers to each step."""
        off = cob_id | 0x8000_0000
        steps = [(parameter, 1, off, 4), (parameter + 0x200, 0, 0, 1)]
        steps += [(parameter + 0x200, k, entry, 4) for k, entry in enumerate(entries, 1)]
        steps += [(parameter + 0x200, 0, len(entries), 1), (parameter, 2, kind, 1)]
        return [self.write(*step) for step in [*steps, (parameter, 1, cob_id, 4)]]

    def enable(self) -> None:
        """Group PDO of type 1, six-byte TPDO of type 1, torque mode, OPERATION ENABLED."""
        self.write(0x1801, 1, 0xC0000280 + self.node, 4)
        answers = self.map_pdo(0x1800, 0x40000180 + self.node, [0x60410010, 0x60640020], 1)
        slots = [0x00030010, 0x00030010, 0x60710010, 0x00030010]
        answers += self.map_pdo(0x1400, 0x200, slots, 1)
        answers += [self.write(0x6060, 0, 10, 1)]
        self.send(0, bytes([1, self.node]))
        answers += [self.write(0x6040, 0, word, 2) for word in (0x06, 0x07, 0x0F)]
        assert answers == [None] * len(answers)

    @property
    def statusword(self) -> int:
        """Object 0x6041."""
        return self.read(0x6041)


@pytest.fixture(scope="session")
def description() -> Description:
    return read_description(shipped_file("puck4.eds")).of_node(3)


@pytest.fixture
def bench(description: Description) -> Bench:
    return Bench(description)


class Master:
    """A master's set-up and cycle on a python-can bus: seven drives, two group PDOs."""

    def __init__(self, bus: can.BusABC) -> None:
        self.bus = bus

    def send(self, can_id: int, data: bytes = b"") -> None:
        """One frame."""
        self.bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))

    def expect(self, *can_ids: int) -> dict[int, bytes]:
        """Data of the next frames of these identifiers; others are passed over."""
        found: dict[int, bytes] = {}
        while len(found) < len(can_ids):
            message = self.bus.recv(5.0)
            assert message is not None, f"no frame; so far {found}"
            if message.arbitration_id in can_ids:
                found[message.arbitration_id] = bytes(message.data)
        return found

    def write(self, node: int, index: int, subindex: int, value: int, size: int) -> None:
        """Expedited download that must succeed."""
        data = value.to_bytes(size, "little").ljust(4, b"\0")
        head = struct.pack("<BHB", 0x23 | (4 - size) << 2, index, subindex)
        self.send(0x600 + node, head + data)
        assert self.expect(0x580 + node)[0x580 + node][0] == 0x60

    def enable(self) -> None:
        """All drives to OPERATION ENABLED in torque mode."""
        for node in range(1, 8):
            slots = [0x00030010] * 4
            slots[(node - 1) % 4] = 0x60710010
            self.write(node, 0x1801, 1, 0xC0000280 + node, 4)
            self._map(node, 0x1800, 0x40000180 + node, [0x60410010, 0x60640020])
            self._map(node, 0x1400, 0x200 if node < 5 else 0x300, slots)
            self.write(node, 0x6060, 0, 10, 1)
        self.send(0, b"\x01\x00")
        for word in (0x06, 0x07, 0x0F):
            for node in range(1, 8):
                self.write(node, 0x6040, 0, word, 2)

    def cycle(self, permille: list[int]) -> list[int]:
        """One SYNC, the positions [counts] of all drives, and their next torques."""
        self.send(0x080)
        answers = self.expect(*range(0x181, 0x188))
        self.send(0x200, struct.pack("<4h", *permille[:4]))
        self.send(0x300, struct.pack("<4h", *permille[4:], 0))
        return [struct.unpack("<Hi", answers[0x180 + node])[1] for node in range(1, 8)]

    def _map(self, node: int, parameter: int, cob_id: int, entries: list[int]) -> None:
        self.write(node, parameter, 1, cob_id | 0x8000_0000, 4)
        self.write(node, parameter + 0x200, 0, 0, 1)
        for k, entry in enumerate(entries, 1):
            self.write(node, parameter + 0x200, k, entry, 4)
        self.write(node, parameter + 0x200, 0, len(entries), 1)
        self.write(node, parameter, 2, 1, 1)
        self.write(node, parameter, 1, cob_id, 4)


@pytest.fixture
def master():
    """The class `Master`."""
    return Master
