"""A simulated classic arm on the embedded bus, with hands on its inside."""

import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest
import yaml

from sim_bus.assembly import Simulation, load_simulation
from sim_bus.can_bus.frame import Frame
from sim_bus.can_bus.hub import Hub, Received
from sim_bus.can_bus.hubs import open_hub
from sim_bus.can_bus.waiting import Source
from sim_bus.faults.assembly import load_faulty_simulation
from sim_bus.puck import safety_node
from sim_bus.puck.drive import PuckDrive
from sim_bus.puck.safety_module import Press
from sim_bus.puck.safety_node import SafetyNode
from sim_bus.server import Arm, Lockstep
from tests.bus.buses import BUSES, EMBEDDED
from tests.bus.serving import served_by_thread
from wamctl.arm.config import ArmFile, PuckDrivesSection, find_file, load_arm_file
from wamctl.arm.recording import Recording, read_recording
from wamctl.arm.trajectory import FourierSeries, Trajectory, write_trajectory
from wamctl.drives.bus import Channel
from wamctl.drives.interface import Readings
from wamctl.errors import StopError
from wamctl.experiment.excite import ExciteRequest, excite
from wamctl.experiment.preflight import prepare
from wamctl.experiment.session import Setup
from wamctl.puck.master import PuckDrives


@dataclass
class ClassicArm:
    """A served arm.

    Attributes:
        bus_word: its bus, INTERFACE:CHANNEL.
        path: its configuration file.
        simulation: its inside.
        hub: its bus.
    """

    bus_word: str
    path: Path
    simulation: Simulation
    hub: "Muffled"

    @property
    def file(self) -> ArmFile:
        return load_arm_file(self.path)

    @property
    def pucks(self) -> tuple[PuckDrive, ...]:
        return tuple(m for m in self.simulation.arm.motors if isinstance(m, PuckDrive))

    @property
    def safety(self) -> SafetyNode:
        (node,) = (n for n in self.simulation.arm.nodes if isinstance(n, SafetyNode))
        return node

    def press(self, button: Press) -> None:
        """A button of the pendant, pressed before the next frame arrives."""
        now = self.simulation.arm.plant.time_ns
        self.hub.accidents.append(lambda: self.safety.press(button, now))

    def happen(self, accident: Callable[[], object]) -> None:
        """Something that happens before the next frame arrives."""

        def silently() -> list[Frame]:
            accident()
            return []

        self.hub.accidents.append(silently)

    @contextmanager
    def bus(self) -> Iterator[can.BusABC]:
        interface, channel = self.bus_word.split(":")
        with can.Bus(interface=interface, channel=channel) as bus:
            yield bus

    @contextmanager
    def drives(self, **changes: object) -> Iterator["Rig"]:
        """Its master; `changes` are to the master's `drives` section, not to the arm's."""
        file = self.file
        section = file.drives.model_copy(update=changes)
        assert isinstance(section, PuckDrivesSection)
        with self.bus() as bus:
            yield Rig(PuckDrives(bus, file, section, Channel("simbus", "sim"), lockstep=True))


class Until:
    """A cycle that waits until an instant of the monotonic clock, and takes each frame as new."""

    def __init__(self, end_s: float) -> None:
        self._end_s = end_s

    def remaining(self) -> float:
        return self._end_s - time.monotonic()

    def age(self, stamp_s: float) -> float:
        return 0.0


class Rig:
    """A master, and a loop around it that is as small as can be."""

    def __init__(self, drives: PuckDrives) -> None:
        self.drives = drives
        self.acting: list[np.ndarray] = []

    def listen(self, seconds: float) -> Readings:
        """A poll, and what comes within a time."""
        return self.drives.sample(Until(time.monotonic() + seconds))

    def cycle(self, tau_motor: np.ndarray | None = None) -> Readings:
        readings = self.listen(0.2)
        self.acting.append(self.drives.send(np.zeros(7) if tau_motor is None else tau_motor))
        return readings

    def until(self, wanted: Callable[[Readings], bool], cycles: int) -> Readings:
        """Cycles until the readings are as wanted; fails if they never are."""
        for _ in range(cycles):
            readings = self.cycle()
            if wanted(readings):
                return readings
        raise AssertionError(f"not within {cycles} cycles: {readings}")

    def enabled(self) -> "Rig":
        """Set up, started, and activated by the operator at the pendant."""
        self.drives.set_up()
        self.drives.start()
        self.drives.enable()
        self.until(lambda r: r.enabled, 300)
        return self

    def fault(self, cycles: int) -> str:
        """The fault that comes within so many cycles."""
        fault = self.until(lambda r: r.fault is not None, cycles).fault
        assert fault is not None
        return fault


class Muffled:
    """A bus on which frames towards the master get lost or altered, and things happen.

    Attributes:
        alters: what the master hears instead of a frame; None for nothing.
        accidents: what is to happen before the next frame arrives; each returns frames on the bus.
    """

    def __init__(self, hub: Hub) -> None:
        self.alters: Callable[[Frame], Frame | None] = lambda frame: frame
        self.accidents: deque[Callable[[], list[Frame]]] = deque()
        self._hub = hub
        self.sources, self.settle, self.close = hub.sources, hub.settle, hub.close
        self.flush = hub.flush

    def receive(self, readable: Sequence[Source]) -> list[Received]:
        heard = self._hub.receive(readable)
        if heard and self.accidents:
            return [Received(f, None, None) for f in self.accidents.popleft()()] + heard
        return heard

    def deliver(self, frames: Sequence[Frame], sender: object, time_ns: int) -> None:
        altered = [self.alters(frame) for frame in frames]
        left = [frame for frame in altered if frame is not None]
        if left:
            self._hub.deliver(left, sender, time_ns)


class Witness:
    """An arm that remembers its bus, and when its motors gave torque.

    Attributes:
        seen: time [ns], whether any motor was driven, largest torque [Puck units].
        frames: all frames on its bus.
    """

    def __init__(self, arm: Arm, pucks: Sequence[PuckDrive]) -> None:
        self.seen: list[tuple[int, bool, int]] = []
        self.frames: list[Frame] = []
        self._arm, self._pucks = arm, pucks
        self.boot, self.tick = arm.boot, arm.tick

    def receive(self, time_ns: int, frame: Frame) -> list[Frame]:
        self.frames.append(frame)
        return self._arm.receive(time_ns, frame)

    def overhear(self, time_ns: int, frame: Frame) -> list[Frame]:
        self.frames.append(frame)
        return self._arm.overhear(time_ns, frame)

    @property
    def next_ns(self) -> int:
        return self._arm.next_ns

    def run_physics(self, time_ns: int) -> None:
        driven = any(p.is_enabled for p in self._pucks)
        self.seen.append((time_ns, driven, max(abs(p.torque_units) for p in self._pucks)))
        self._arm.run_physics(time_ns)


def content() -> dict[str, Any]:
    """The shipped classic arm's file."""
    found = yaml.safe_load(find_file("wam7-classic.yaml").read_text())
    found["robot"]["urdf"] = str(find_file("wam7.urdf"))
    return found


@contextmanager
def served(folder: Path, word: str, **changes: object) -> Iterator[ClassicArm]:
    """A simulated classic arm in lockstep whose `drives` section is changed."""
    file = content()
    file["robot"]["gravity_m_s2"] = [0.0, 0.0, 0.0]  # without torque it stays where it is
    file["drives"] |= changes
    path = folder / "arm.yaml"
    path.write_text(yaml.safe_dump(file))
    simulation = load_simulation(path, 0)
    simulation.arm.plant.warm_up()
    hub = Muffled(open_hub(word, fd=False))
    service = Lockstep(simulation.arm, hub, simulation.period_ns, simulation.schedule)
    with served_by_thread(service, hub):
        yield ClassicArm(word, path, simulation, hub)


@pytest.fixture(autouse=True)
def quick_operator(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(safety_node, "ACTIVATES_AFTER_NS", 20_000_000)


@pytest.fixture(params=BUSES)
def bus_word(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """The embedded bus, and the kernel's."""
    return f"simbus:{tmp_path / 'bus'}" if request.param == EMBEDDED else "socketcan:vcan0"


@pytest.fixture
def classic(tmp_path: Path, bus_word: str) -> Iterator[ClassicArm]:
    """An arm in lockstep, which must end without torque."""
    with served(tmp_path, bus_word) as arm:
        yield arm
    assert [p.torque_units for p in arm.pucks] == [0] * 7


@pytest.fixture
def serve_classic(
    tmp_path: Path, bus_word: str
) -> Callable[..., AbstractContextManager[ClassicArm]]:
    """Serves arms whose `drives` section is changed."""
    return partial(served, tmp_path, bus_word)


@dataclass(frozen=True)
class Outcome:
    """How an experiment with a fault ended.

    Attributes:
        stop: why it ended early; None if it did not.
        began_ns: when the fault began.
        seen, frames: see `Witness`.
        recording: the log.
    """

    stop: StopError | None
    began_ns: int
    seen: list[tuple[int, bool, int]]
    frames: list[Frame]
    recording: Recording

    def quiet_after_s(self) -> float:
        """Time from the fault to the last torque [s]."""
        last = max(time_ns for time_ns, driven, units in self.seen if driven and units)
        return (last - self.began_ns) * 1e-9


@pytest.fixture
def experiment(tmp_path: Path, bus_word: str) -> Callable[..., Outcome]:
    """Runs a short experiment during which faults of a fault file happen."""
    return partial(run_experiment, tmp_path, bus_word)


def run_experiment(folder: Path, word: str, *happens: dict[str, object]) -> Outcome:
    path, faults, log = folder / "arm.yaml", folder / "faults.yaml", folder / "log.mcap"
    path.write_text(yaml.safe_dump(short_experiment(folder)))
    faults.write_text(yaml.safe_dump({"faults": list(happens)}))
    said: list[str] = []
    simulation, arm = load_faulty_simulation(path, 0, faults, said.append)
    simulation.arm.plant.warm_up()
    pucks = [m for m in simulation.arm.motors if isinstance(m, PuckDrive)]
    witness, hub = Witness(arm, pucks), open_hub(word, fd=False)
    stop = None
    with served_by_thread(Lockstep(witness, hub, simulation.period_ns, simulation.schedule), hub):
        prepared = prepare(path)
        setup = Setup(path, prepared.arm, word, lockstep=True)
        try:
            excite(ExciteRequest(prepared, setup, log, lambda _: None, tests_motors=False))
        except StopError as error:
            stop = error
        let_time_pass(witness)
    began = float(said[0].split(" begins at ")[1].split(" s")[0]) if said else 0.0
    return Outcome(stop, round(began * 1e9), witness.seen, witness.frames, read_recording(log))


def let_time_pass(witness: Witness) -> None:
    """A fifth of a second without the master, which lockstep would not let pass."""
    start_ns = witness.seen[-1][0]
    for k in range(1, 101):
        now_ns = start_ns + k * 2_000_000
        for frame in witness.tick(now_ns):
            witness.overhear(now_ns, frame)
        witness.run_physics(now_ns)


def short_experiment(folder: Path) -> dict[str, Any]:
    """One second of motion, near the pose in which the arm rests."""
    file = content()
    pose = file["simulation"]["start_pose_rad"]
    names = tuple(file["robot"]["joints"])
    fundamental = 2.0 * np.pi
    series = FourierSeries(
        names, fundamental, np.full((7, 1), 0.3), np.zeros((7, 1)), np.array(pose)
    )
    write_trajectory(folder / "trajectory.yaml", Trajectory(series, 1, {}, {}))
    file["excitation"] |= {"trajectory": "trajectory.yaml", "ramp_s": 0.5, "periods": 1}
    file["excitation"] |= {"fundamental_rad_s": fundamental, "harmonics": 1}
    return file
