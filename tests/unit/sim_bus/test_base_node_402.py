"""An independent master, canopen's own, against a simulated drive."""

from collections.abc import Iterator

import can
import canopen
import pytest
from canopen.profiles.p402 import BaseNode402

from wamctl.arm.config import shipped_file


@pytest.fixture
def node(real_time_bus: str) -> Iterator[BaseNode402]:
    network = canopen.Network()
    network.connect(interface="simbus", channel=real_time_bus)
    try:
        node = BaseNode402(3, str(shipped_file("puck4.eds")))
        network.add_node(node)
        be_patient(node)
        node.nmt.state = "PRE-OPERATIONAL"
        yield node
    finally:
        network.sync.stop()
        network.disconnect()


def be_patient(node: BaseNode402) -> None:
    """The tests are about what happens, not about how busy the machine is."""
    node.sdo.RESPONSE_TIMEOUT = 10.0
    for name in dir(node):
        if name.startswith("TIMEOUT_"):
            setattr(node, name, 10.0)


def enable(node: BaseNode402) -> None:
    node.setup_402_state_machine()
    node.sdo[0x1801][1].raw = 0xC0000283
    node.rpdo[1].trans_type = 255
    node.rpdo[1].save()
    node.nmt.state = "OPERATIONAL"
    node.network.sync.start(0.005)
    node.op_mode = "CYCLIC SYNCHRONOUS TORQUE"
    node.state = "OPERATION ENABLED"


def test_to_operation_enabled_and_back(node: BaseNode402) -> None:
    enable(node)
    assert node.state == "OPERATION ENABLED"
    assert node.op_mode == "CYCLIC SYNCHRONOUS TORQUE"
    assert node.statusword & 0x1000
    node.state = "SWITCH ON DISABLED"
    assert node.state == "SWITCH ON DISABLED"


def test_quick_stop(node: BaseNode402) -> None:
    enable(node)
    node.state = "QUICK STOP ACTIVE"
    assert node.state == "QUICK STOP ACTIVE"


def test_identity(node: BaseNode402) -> None:
    assert [node.sdo[0x1018][k].raw for k in (1, 2, 3, 4)] == [0x408, 0x4, 0x40004, 4003]
    assert node.sdo[0x1008].raw == "Puck 4"
    assert node.sdo[0x1000].raw == 0x00020192
    assert node.sdo[0x6076].raw == 1490


def test_a_read_only_object_stays(node: BaseNode402) -> None:
    with pytest.raises(canopen.SdoAbortedError) as caught:
        node.sdo.download(0x6041, 0, b"\0\0")
    assert caught.value.code == 0x06010002


def test_the_whole_dictionary_is_read(node: BaseNode402) -> None:
    for entry in node.object_dictionary.indices.values():
        if entry.index < 0x1000:
            continue
        subindices = [0] if isinstance(entry, canopen.objectdictionary.ODVariable) else entry
        for subindex in subindices:
            assert node.sdo.upload(entry.index, subindex) != b""


def test_no_server_is_one_sentence(tmp_path) -> None:
    with pytest.raises(can.CanInitializationError) as caught:
        can.Bus(interface="simbus", channel=str(tmp_path / "none"))
    assert str(caught.value) == (
        f"no simulated bus listens on {tmp_path}/none (No such file or directory): "
        f"start it with `sim-bus serve --bus simbus:{tmp_path}/none`"
    )
