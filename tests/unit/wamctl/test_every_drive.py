"""A step for every drive: all faults together, and a bus on which nobody answers."""

import pytest

from wamctl.arm.config import BusSection
from wamctl.drives.bus import Channel, open_bus
from wamctl.drives.every_drive import for_every_drive
from wamctl.errors import BusError, DrivesError, SilentDriveError

CHANNEL = Channel("socketcan", "can0")


def told(errors):
    def step(place):
        if errors[place] is not None:
            raise errors[place]

    with pytest.raises(DrivesError) as error:
        for_every_drive([f"drive {k}" for k in range(len(errors))], step, CHANNEL)
    return str(error.value)


def test_one_silent_drive_among_others_is_its_own_fault():
    assert told([None, SilentDriveError("is silent")]) == (
        "drive 1: is silent (bus socketcan:can0). No drive was enabled."
    )


def test_all_faults_are_told_together():
    assert told([SilentDriveError("is silent"), BusError("is another")]).splitlines()[1:] == [
        "  - drive 0: is silent",
        "  - drive 1: is another",
    ]


def test_where_nobody_answers_the_bus_is_to_blame():
    sentence = told([SilentDriveError("is silent")] * 7)
    assert sentence.startswith("No drive answers on bus socketcan:can0, and none was enabled")
    assert "drive 1" not in sentence


@pytest.mark.parametrize(("number", "words"), [(97, "this kernel has no CAN"), (19, "`ip link`")])
def test_a_socket_that_cannot_be_opened_says_what_to_do(monkeypatch, number, words):
    def refused(*_, **__):
        raise OSError(number, "in the kernel's words")

    monkeypatch.setattr("wamctl.drives.bus.BurstBus", refused)
    with pytest.raises(BusError, match=words):
        open_bus(CHANNEL, BusSection(channel="socketcan:can0"))
