"""A bus that one `wamctl` has: every command beside it is refused, and sends nothing."""

import subprocess
import sys

from wamctl.drives.bus import parse_channel
from wamctl.drives.one_master import locked

MOVES = "--lockstep --yes-move-the-arm wam7"
COMMANDS = {
    "check": "",
    "bench": "",
    "monitor": "",
    "home": "",
    "excite": f"{MOVES} --out {{folder}}/log.mcap",
    "investigate": f"{MOVES} --out {{folder}}/investigation",
}
RUN = """
import sys
from wamctl.cli import main

for line in sys.stdin.read().splitlines():
    sys.argv[:] = ["wamctl", *line.split()]
    try:
        main()
    except SystemExit as ended:
        print(ended.code, flush=True)
"""


def test_every_command_is_refused_on_a_bus_in_use(tmp_path):
    """Each command holds this lock for as long as it has the drives."""
    bus = f"simbus:{tmp_path}/socket"
    lines = [
        f"{name} --config wam7.yaml --bus {bus} {options.format(folder=tmp_path)}"
        for name, options in COMMANDS.items()
    ]
    with locked(parse_channel(bus)):
        done = subprocess.run(
            [sys.executable, "-c", RUN],
            input="\n".join(lines),
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )
    assert done.stdout.split() == ["4"] * len(COMMANDS)
    sentence = f"Bus {bus} is in use by another wamctl on this machine; nothing was sent"
    told = [line for line in done.stderr.splitlines() if line.startswith(sentence)]
    assert told == [
        *[f"{sentence}."] * (len(COMMANDS) - 1),
        f"{sentence} (wamctl excite; --resume goes on).",
    ]
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "log.mcap").exists()
