"""The drive's dictionary, read by the npm package `canopen`, which we did not write."""

import json
import shutil
import subprocess
import threading
from pathlib import Path
from typing import Any

import can
import pytest

from sim_bus.canopen.drive import CanopenDrive
from tests.bus.buses import on_embedded_bus
from wamctl.arm.config import find_file

PACKAGE = "canopen@6.2.1"
NODE, NPM = shutil.which("node"), shutil.which("npm")
NODE_ID = 4

pytestmark = pytest.mark.skipif(not (NODE and NPM), reason="node and npm are not installed")


@pytest.fixture(scope="module")
def modules(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the package."""
    folder = tmp_path_factory.mktemp("npm")
    install = [str(NPM), "install", "--ignore-scripts", "--no-audit", "--no-fund", PACKAGE]
    done = subprocess.run(
        install, cwd=folder, capture_output=True, text=True, timeout=120, check=False
    )
    if done.returncode:
        pytest.skip(f"npm cannot install {PACKAGE}: {done.stderr.strip().splitlines()[-1:]}")
    return folder / "node_modules"


def walked(modules: Path, bus: can.BusABC) -> list[dict[str, Any]]:
    """What the walk found; the bus is carried to it and back."""
    script, eds = Path(__file__).with_name("walk_dictionary.js"), find_file("puck4.eds")
    command = [str(NODE), str(script), str(modules), str(eds), str(NODE_ID)]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True) as peer:
        assert peer.stdin
        assert peer.stdout
        ended = threading.Event()
        thread = threading.Thread(target=_carry, args=(bus, peer.stdin, ended))
        thread.start()
        try:
            for line in peer.stdout:
                word, _, rest = line.strip().partition(" ")
                if word == "found":
                    return json.loads(rest)
                bus.send(
                    can.Message(
                        arbitration_id=int(word, 16), is_extended_id=False, data=bytes.fromhex(rest)
                    )
                )
        finally:
            ended.set()
            thread.join()
    raise AssertionError("the walk ended without a result")


def _carry(bus: can.BusABC, to: Any, ended: threading.Event) -> None:
    while not ended.is_set():
        message = bus.recv(0.05)
        if message is not None and not ended.is_set():
            to.write(f"{message.arbitration_id:x} {bytes(message.data).hex()}\n")
            to.flush()


@on_embedded_bus("word")
def test_every_object_of_the_eds_is_there(serve_arms, modules):
    with serve_arms() as arm:
        interface, channel = arm.word.split(":", 1)
        with can.Bus(interface=interface, channel=channel) as bus:
            found = walked(modules, bus)
        (drive,) = (m for m in arm.simulation.arm.motors if m.node_id == NODE_ID)
        arm.expected = {drive.motor.state}
    assert isinstance(drive, CanopenDrive)
    assert [entry for entry in found if "error" in entry] == []
    held = {(entry["index"], entry["subIndex"]): entry["value"] for entry in found}
    assert len(held) > 100
    assert held[0x1018, 1] == 0x408
    assert held[0x1018, 2] == 0x4
    assert held[0x6076, 0] == 1490  # [mN m]
    assert held[0x1017, 0] == drive.objects.values[0x1017, 0]
    assert held[0x6064, 0] == arm.simulation.arm.encoders.position(3)
