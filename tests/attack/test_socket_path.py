"""A path for the simulated bus that belongs to somebody else."""

import socket

import pytest

from sim_bus.can_bus.socket_hub import SocketHub
from sim_bus.errors import SimulatedBusError


def test_a_file_is_never_deleted(tmp_path):
    path = tmp_path / "thesis.txt"
    path.write_text("years of work")
    with pytest.raises(SimulatedBusError, match="a file of that name exists"):
        SocketHub(path)
    assert path.read_text() == "years of work"


def test_the_socket_of_another_server_is_left_to_it(tmp_path):
    first = SocketHub(tmp_path / "bus")
    with pytest.raises(SimulatedBusError, match="another sim-bus serves it"):
        SocketHub(tmp_path / "bus")
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as client:
        client.connect(str(tmp_path / "bus"))
    first.close()


def test_a_socket_that_a_killed_server_left_behind_is_taken_over(tmp_path):
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as dead:
        dead.bind(str(tmp_path / "bus"))
    SocketHub(tmp_path / "bus").close()
