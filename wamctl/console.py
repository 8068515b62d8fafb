"""Entry point of the console script: `wamctl`, or what its installation lacks."""

import sys

from wamctl.arm.command_line import can_missing, system_libraries


def main() -> None:
    """Run the command where the CAN libraries are installed."""
    if sentence := can_missing("wamctl"):
        sys.stderr.write(sentence)
        sys.exit(3)
    with system_libraries("wamctl"):
        from wamctl.cli import main as run  # it imports these libraries

    run()
