"""Bash completes the commands' sub-commands and options."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

CASES = [
    ("wamctl", "excite --lock", "--lockstep"),
    ("sim-bus", "ser", "serve"),
    ("ident", "exp", "export"),
]


@pytest.mark.parametrize(("command", "typed", "expected"), CASES)
def test_completion(command: str, typed: str, expected: str) -> None:
    words = f"{command} {typed}"
    variable = f"_{command.replace('-', '_').upper()}_COMPLETE"
    environment = os.environ | {
        variable: "complete_bash",
        "COMP_WORDS": words,
        "COMP_CWORD": str(words.count(" ")),
    }
    result = subprocess.run(
        [Path(sys.executable).parent / command],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert expected in result.stdout.split()
    assert result.stderr == ""
