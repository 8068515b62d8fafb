"""The SDO server and the object dictionary of a drive."""

import struct

import pytest

from sim_bus.canopen.dictionary import Abort, read_description
from wamctl.arm.errors import ConfigurationError


def ask(bench, *request):
    (response,) = bench.send(0x603, bytes(request).ljust(8, b"\0"))
    assert response.can_id == 0x583
    return response.data


def abort(index, subindex, code):
    return struct.pack("<BHBI", 0x80, index, subindex, code)


def test_absent_in_the_puck_absent_here(bench):
    for index in (0x6077, 0x6075, 0x1016):
        assert ask(bench, 0x40, index & 0xFF, index >> 8, 0) == abort(index, 0, 0x06020000)


@pytest.mark.parametrize(
    ("index", "subindex", "value", "size", "code"),
    [
        (0x6077, 0, 0, 2, Abort.NO_OBJECT),
        (0x1018, 9, 0, 4, Abort.NO_SUBINDEX),
        (0x6041, 0, 0, 2, Abort.READ_ONLY),
        (0x1008, 0, 0, 4, Abort.READ_ONLY),
        (0x6071, 0, 0, 4, Abort.LENGTH),
        (0x1017, 0, 0, 1, Abort.LENGTH),
        (0x6060, 0, 8, 1, Abort.VALUE_RANGE),
        (0x1600, 0, 17, 1, Abort.VALUE_RANGE),
        (0x1003, 0, 1, 1, Abort.VALUE_RANGE),
    ],
)
def test_a_wrong_write_is_refused_with_its_code(bench, index, subindex, value, size, code):
    assert bench.write(index, subindex, value, size) == code


def test_a_write_is_read_back(bench):
    assert bench.write(0x2406, 0, 20, 2) is None
    assert bench.read(0x2406) == 20
    assert bench.write(0x60C2, 2, -3, 1) is None
    assert bench.read(0x60C2, 2) == 0xFD


def test_a_write_without_size_takes_the_size_of_the_object(bench):
    assert ask(bench, 0x22, 0x06, 0x24, 0, 30, 0, 0xEE, 0xEE)[0] == 0x60
    assert bench.read(0x2406) == 30


def test_a_string_comes_in_segments(bench):
    first = ask(bench, 0x40, 0x09, 0x10, 0)
    assert first == struct.pack("<BHBI", 0x41, 0x1009, 0, len(b"simulated"))
    assert ask(bench, 0x60) == b"\x00simulat"
    assert ask(bench, 0x70) == b"\x1bed\0\0\0\0\0"
    assert ask(bench, 0x60) == abort(0x1009, 0, 0x05040001)


def test_a_toggle_bit_that_stands_still_aborts(bench):
    ask(bench, 0x40, 0x09, 0x10, 0)
    ask(bench, 0x60)
    assert ask(bench, 0x60) == abort(0x1009, 0, 0x05030000)


def test_a_download_in_segments(bench):
    assert ask(bench, 0x21, 0x06, 0x24, 0, 2)[0] == 0x60
    assert ask(bench, 0x0B, 40, 0) == b"\x20" + bytes(7)
    assert bench.read(0x2406) == 40


def test_a_block_transfer_is_refused(bench):
    assert ask(bench, 0xC0, 0x06, 0x24, 0) == abort(0x2406, 0, 0x05040001)
    assert ask(bench, 0xA0, 0x06, 0x24, 0) == abort(0x2406, 0, 0x05040001)


def test_a_short_request_and_an_abort_get_no_answer(bench):
    assert bench.send(0x603, b"\x40\x06\x24") == []
    assert bench.send(0x603, bytes([0x80, 0x06, 0x24, 0, 0, 0, 0, 0])) == []


def test_the_description_has_the_dummies_of_the_standard(description):
    assert description.dummies == {2: 1, 3: 2, 4: 4, 5: 1, 6: 2, 7: 4}


def test_a_missing_eds_is_one_sentence(tmp_path):
    path = tmp_path / "none.eds"
    with pytest.raises(ConfigurationError) as caught:
        read_description(path)
    assert str(caught.value) == (
        f"{path}: not a readable EDS file ([Errno 2] No such file or directory: '{path}')."
    )


def test_a_broken_eds_is_one_sentence(tmp_path):
    path = tmp_path / "broken.eds"
    path.write_text("[DeviceInfo]\n")
    with pytest.raises(ConfigurationError) as caught:
        read_description(path)
    assert str(caught.value) == f"{path}: not a readable EDS file (it describes no object)."
