"""A simulated Puck 4 arm in lockstep, on the embedded bus and on SocketCAN, and its experiment."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
import yaml

from sim_bus.assembly import Simulation
from sim_bus.can_bus.frame import Frame
from sim_bus.can_bus.hubs import open_hub
from sim_bus.canopen.drive import CanopenDrive
from sim_bus.canopen.ds402 import State
from sim_bus.faults.assembly import load_faulty_simulation
from sim_bus.server import Arm, Lockstep
from tests.bus.buses import BUSES, EMBEDDED
from tests.bus.serving import served_by_thread
from wamctl.arm.config import find_file
from wamctl.arm.errors import UserError
from wamctl.arm.recording import Recording, read_recording
from wamctl.arm.trajectory import FourierSeries, Trajectory, write_trajectory
from wamctl.experiment.excite import ExciteRequest, Summary, excite
from wamctl.experiment.preflight import prepare
from wamctl.experiment.session import Setup

START = (0.0, -1.0, 0.0, 2.5, 0.0, 0.0, 0.0)


class Witness:
    """An arm that remembers the drives' torques and every frame from the master.

    Attributes:
        torques: time [ns] and the torques in per mille of rated torque, whenever physics goes on.
        heard: time [ns] and frame.
        on_sync: what happens before a SYNC arrives, by its number.
    """

    def __init__(self, arm: Arm, simulation: Simulation) -> None:
        self.torques: list[tuple[int, tuple[int, ...]]] = []
        self.heard: list[tuple[int, Frame]] = []
        self.on_sync: dict[int, Callable[[], None]] = {}
        self._syncs = 0
        self._arm = arm
        self.motors = [m for m in simulation.arm.motors if isinstance(m, CanopenDrive)]
        self.boot, self.tick, self.overhear = arm.boot, arm.tick, arm.overhear

    @property
    def next_ns(self) -> int:
        return self._arm.next_ns

    @property
    def sync_ns(self) -> list[int]:
        return [time_ns for time_ns, frame in self.heard if frame.can_id == 0x080]

    def receive(self, time_ns: int, frame: Frame) -> list[Frame]:
        self.heard.append((time_ns, frame))
        if frame.can_id == 0x080:
            self._syncs += 1
            self.on_sync.pop(self._syncs, lambda: None)()
        return self._arm.receive(time_ns, frame)

    def run_physics(self, time_ns: int) -> None:
        self.torques.append((time_ns, tuple(m.motor.torque_permille for m in self.motors)))
        self._arm.run_physics(time_ns)


@dataclass
class Outcome:
    """How an experiment ended.

    Attributes:
        summary: its result, or None.
        error: why it ended early, or None.
        recording: its log, or None where there is none.
    """

    summary: Summary | None
    error: UserError | None
    recording: Recording | None


@dataclass
class ServedArm:
    """A served arm.

    Attributes:
        word: its bus, for `--bus`.
        path: its file.
        simulation: its inside.
        witness: what it saw.
        said: which faults began.
        expected: states in which its drives may be at the end.
    """

    word: str
    path: Path
    simulation: Simulation
    witness: Witness
    said: list[str]
    expected: set[State] = field(default_factory=lambda: {State.SWITCH_ON_DISABLED})

    @property
    def setup(self) -> Setup:
        prepared = prepare(self.path)
        return Setup(prepared.path, prepared.arm, self.word, lockstep=True)

    def excite(
        self,
        name: str = "log.mcap",
        confirm: Callable = lambda c: None,
        tests_motors: bool = False,
    ) -> Outcome:
        prepared = prepare(self.path)
        out = self.path.with_name(name)
        setup = Setup(prepared.path, prepared.arm, self.word, lockstep=True)
        summary = error = None
        try:
            summary = excite(
                ExciteRequest(prepared, setup, out, confirm, tests_motors=tests_motors)
            )
        except UserError as raised:
            error = raised
        return Outcome(summary, error, read_recording(out) if out.exists() else None)


def configuration(folder: Path, periods: int = 1, **changes: dict[str, Any]) -> Path:
    """The shipped arm with an experiment of so many seconds, and changes to its sections."""
    content = yaml.safe_load(find_file("wam7.yaml").read_text())
    content["robot"]["urdf"] = str(find_file("wam7.urdf"))
    content["drives"]["dictionary"] = str(find_file("puck4.eds"))
    content["excitation"] |= {"trajectory": "short.yaml", "ramp_s": 0.5}
    for section, values in changes.items():
        content[section] |= values
    joints = tuple(content["robot"]["joints"])
    series = FourierSeries(
        joints, 2 * np.pi, np.full((7, 1), 0.4), np.zeros((7, 1)), np.array(START) + 0.05
    )
    write_trajectory(folder / "short.yaml", Trajectory(series, periods, {}, {}))
    path = folder / "arm.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


@pytest.fixture(scope="module", params=BUSES)
def word(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> str:
    """The bus of the tests, as `--bus` takes it."""
    if request.param == EMBEDDED:
        return f"simbus:{tmp_path_factory.mktemp('bus') / 'socket'}"
    return f"socketcan:{request.config.getoption('--can') or 'vcan0'}"


@pytest.fixture(scope="module")
def serve_arms(word: str, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Any]:
    """Serves arms with faults and changes; at its end nothing may give torque or be left."""

    @contextmanager
    def served(*faults: dict[str, Any], seed: int = 0, **changes: Any) -> Iterator[ServedArm]:
        threads, children = set(threading.enumerate()), psutil.Process().children()
        folder = tmp_path_factory.mktemp("arm")
        path, script = configuration(folder, **changes), folder / "faults.yaml"
        script.write_text(yaml.safe_dump({"faults": list(faults)}))
        said: list[str] = []
        simulation, arm = load_faulty_simulation(path, seed, script, said.append)
        simulation.arm.plant.warm_up()
        witness = Witness(arm, simulation)
        served_arm = ServedArm(word, path, simulation, witness, said)
        hub = open_hub(word, fd=False)
        service = Lockstep(witness, hub, simulation.period_ns, simulation.schedule)
        with served_by_thread(service, hub):
            yield served_arm
        assert [m.motor.torque_permille for m in witness.motors] == [0] * 7
        assert {m.motor.state for m in witness.motors} <= served_arm.expected
        assert set(threading.enumerate()) <= threads
        assert set(psutil.Process().children()) <= set(children)

    return served


@pytest.fixture(scope="session")
def configure() -> Callable[..., Path]:
    """Writes a short experiment's file into a folder."""
    return configuration
