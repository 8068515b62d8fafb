"""The word for a bus."""

import pytest

from wamctl.arm.config import BusSection
from wamctl.drives.bus import Channel, open_bus, parse_channel
from wamctl.errors import BusError, UsageError


@pytest.mark.parametrize(
    ("word", "interface", "name"),
    [
        ("socketcan:can0", "socketcan", "can0"),
        ("udp_multicast:239.74.163.2", "udp_multicast", "239.74.163.2"),
        ("udp_multicast:ff11::1", "udp_multicast", "ff11::1"),
    ],
)
def test_interface_and_channel(word, interface, name):
    assert parse_channel(word) == Channel(interface, name)
    assert str(parse_channel(word)) == word


def test_a_socket_of_the_simulated_bus_has_one_name(tmp_path, monkeypatch):
    """The lock of a bus goes by its name."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "link").symlink_to(tmp_path)
    words = ("arm", "./arm", f"{tmp_path}//arm", "link/arm")
    assert {parse_channel(f"simbus:{w}").name for w in words} == {f"{tmp_path.resolve()}/arm"}


@pytest.mark.parametrize("word", ["can0", "socketcan:", ":can0", ""])
def test_what_is_no_bus(word):
    with pytest.raises(UsageError) as error:
        parse_channel(word)
    assert str(error.value) == (
        f"bus {word!r} is neither `sim` nor INTERFACE:CHANNEL, such as socketcan:can0; "
        "`--bus sim` runs the simulated arm and needs no hardware."
    )


def test_an_unknown_interface_lists_the_known_ones():
    with pytest.raises(UsageError) as error:
        parse_channel("sockercan:can0")
    said = str(error.value)
    assert said.startswith("bus 'sockercan:can0': python-can has no interface 'sockercan' (it has ")
    assert " socketcan," in said


def test_a_bus_that_is_not_there():
    with pytest.raises(BusError) as error:
        open_bus(Channel("simbus", "/nowhere/bus"), BusSection(channel="sim"))
    assert error.value.exit_code == 4
    assert str(error.value).startswith("Bus simbus:/nowhere/bus cannot be opened (")
    assert str(error.value).endswith("`--bus sim` runs the simulated arm and needs no hardware.")


@pytest.mark.parametrize(
    ("word", "may"),
    [
        ("socketcan:can0", False),
        ("pcan:PCAN_USBBUS1", False),
        ("socketcan:vcan0", True),
        ("simbus:/tmp/bus", True),
    ],
)
def test_lockstep_is_for_buses_that_no_real_drive_can_be_on(word, may):
    assert parse_channel(word).may_lockstep is may
