"""`wamctl excite --live` as its user meets it: a viewer that comes, and a log like any other."""

import json
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from mcap.reader import make_reader
from websockets.sync.client import connect

pytestmark = pytest.mark.alone

WAMCTL = str(Path(sys.executable).with_name("wamctl"))
TOPICS = ("/joint_states", "/joint_commands", "/joint_reference")


def command(config: Path, out: Path, *more: object) -> list[str]:
    words = ["excite", "--config", config, "--bus", "sim", "--lockstep", "--out", out, *more]
    return [WAMCTL, *map(str, words)]


def rows(log: Path) -> list[tuple[str, int, bytes]]:
    with log.open("rb") as stream:
        found = make_reader(stream).iter_messages(topics=TOPICS)
        return [(channel.topic, m.log_time, m.data) for _, channel, m in found]


@pytest.fixture
def port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def test_a_viewer_is_served_and_the_log_is_the_same(configure, tmp_path, port):
    config, out = configure(tmp_path), tmp_path / "seen.mcap"
    words = command(config, out, "--live", "--live-port", port)
    with subprocess.Popen(words, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as run:
        assert run.stderr is not None
        while (said := run.stderr.readline()).startswith("note: "):
            pass  # a first compilation
        assert said == (f"Live view: in Foxglove, open the connection ws://127.0.0.1:{port}\n")
        with connect(f"ws://127.0.0.1:{port}", subprotocols=["foxglove.sdk.v1"]) as viewer:
            topics = set()
            while not topics >= {*TOPICS, "/diagnostics", "/tf"}:
                message = json.loads(viewer.recv(timeout=20))
                topics |= {channel["topic"] for channel in message.get("channels", [])}
        _, rest = run.communicate(timeout=100)
    assert run.returncode == 0
    assert rest.startswith("Next: ident run ")
    unseen = tmp_path / "unseen.mcap"
    subprocess.run(command(config, unseen), check=True, stdout=subprocess.DEVNULL, timeout=100)
    assert rows(out) == rows(unseen)
