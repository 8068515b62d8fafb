"""PEN, bit by bit."""

import pytest

from wamctl.puck.errors import FrameError
from wamctl.puck.pendant import Button, Light, decode_pendant

ALL_SAFE = 0b001_001_001_001_001


@pytest.mark.parametrize(
    ("bits", "button"),
    [(0b11, Button.NONE), (0b10, Button.IDLE), (0b01, Button.ACTIVATE), (0b00, Button.ESTOP)],
)
def test_button(bits, button):
    assert decode_pendant(bits << 26 | ALL_SAFE).button is button


def test_lights_and_display():
    pendant = decode_pendant(0b11 << 26 | 1 << 25 | 0x3F << 16 | 0b001_100_001_010_001)
    assert pendant.activate_light
    assert not pendant.idle_light
    assert pendant.segments == 0x3F
    assert pendant.lit(Light.FAULT) == ("heartbeat",)
    assert pendant.lit(Light.WARNING) == ("torque",)
    assert pendant.lit(Light.SAFE) == ("velocity", "voltage", "other")


def test_a_light_in_two_states_is_refused():
    with pytest.raises(FrameError) as error:
        decode_pendant(0x0C003000 | ALL_SAFE)
    assert str(error.value) == ("The safety module's PEN 0x0c003249 has no single state for other.")
