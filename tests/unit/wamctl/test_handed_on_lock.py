"""The lock of a bus, handed on to the programs of an investigation."""

import os
import subprocess
import sys

from wamctl.drives.bus import parse_channel
from wamctl.drives.one_master import handed_on, locked

COMMAND = """
from wamctl.drives.bus import parse_channel
from wamctl.drives.one_master import locked
with locked(parse_channel("virtual:handed-on")):
    print("through")
"""


def said(**options) -> str:
    """What a program says that wants the bus."""
    command = [sys.executable, "-c", COMMAND]
    return subprocess.run(command, capture_output=True, text=True, check=False, **options).stdout


def test_only_a_program_with_the_very_lock_goes_through():
    with locked(parse_channel("virtual:handed-on")) as lock:
        assert said(**handed_on(lock)) == "through\n"
        assert said() == ""
        assert said(env=os.environ | {"WAMCTL_BUS_LOCK": "987"}) == ""
        with locked(parse_channel("virtual:another")) as other:
            assert said(**handed_on(other)) == ""
