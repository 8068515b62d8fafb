"""Starts and ends the process that serves the live view, beside the loop."""

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec

from wamctl.errors import UsageError
from wamctl.telemetry.child_process import ChildProcess
from wamctl.telemetry.logger import LogHead

READY = "ready"
PORT = 8765
"""Where Foxglove looks first."""
_START_S, _CLOSE_S = 30.0, 5.0


def check_installed() -> None:
    """See whether there is anything to serve the live view with.

    Raises:
        UsageError: the optional library is not installed.
    """
    if find_spec("foxglove") is None:
        raise UsageError(
            "--live needs foxglove-sdk, which is not installed: pip install 'wam-ident[live]'."
        )


@contextmanager
def live_view(descriptor: int, head: LogHead, port: int = PORT) -> Iterator[None]:
    """A Foxglove server on this machine while the block runs.

    It reads the ring behind the writer's back and takes nothing out of it, so that neither loop nor
    log can be kept waiting. If it dies, the experiment goes on.

    Args:
        descriptor: the ring's.
        head: what the log is about.
        port: where to listen, on the local interface only.

    Raises:
        UsageError: it cannot serve there.
    """
    child = ChildProcess(
        "wamctl.live.server", [str(descriptor), str(port)], [descriptor], quiet=True
    )
    try:
        child.tell(_json(head), _START_S)
        answer = child.answer(_START_S)
        if answer != READY:
            raise UsageError(answer or "The live view ended before it began.")
        sys.stderr.write(f"Live view: in Foxglove, open the connection ws://127.0.0.1:{port}\n")
        yield
    finally:
        child.end(_CLOSE_S)


def _json(head: LogHead) -> str:
    return json.dumps(
        {
            "joint_names": list(head.joint_names),
            "drives": list(head.drives),
            "state_names": dict(head.state_names),
            "urdf": head.attachments["robot.urdf"].decode("utf-8"),
        }
    )
