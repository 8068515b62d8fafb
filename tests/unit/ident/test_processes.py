"""Work in several processes."""

import math
import subprocess
import sys
import time
from multiprocessing import active_children
from pathlib import Path

import pytest

from ident.regression.processes import in_processes


def test_results_come_in_the_order_of_the_items():
    assert list(in_processes(math.sqrt, [9.0, 4.0, 1.0], 2)) == [3.0, 2.0, 1.0]


def test_an_error_comes_through_and_leaves_no_process():
    before = set(active_children())
    with pytest.raises(ValueError, match="math domain"):
        list(in_processes(math.sqrt, [4.0, -1.0], 2))
    assert set(active_children()) == before


ENDLESS = """
import time
from ident.regression.processes import in_processes

if __name__ == "__main__":
    list(in_processes(time.sleep, [600.0, 600.0], 2))
"""


def awaited(condition, seconds=30.0):
    """Whether something comes true in time."""
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.1)
    return condition()


def runs(pid):
    """Whether a process does; one that ended and was not waited for has no command line."""
    try:
        return bool(Path(f"/proc/{pid}/cmdline").read_bytes())
    except OSError:
        return False


def test_a_program_that_is_killed_leaves_no_process(tmp_path):
    script = tmp_path / "endless.py"
    script.write_text(ENDLESS)
    program = subprocess.Popen([sys.executable, script], stderr=subprocess.DEVNULL)
    children = Path(f"/proc/{program.pid}/task/{program.pid}/children")
    assert awaited(lambda: len(children.read_text().split()) == 3)  # two, and multiprocessing's own
    started = [int(pid) for pid in children.read_text().split()]
    time.sleep(1.0)
    program.kill()
    program.wait()
    assert awaited(lambda: not any(runs(pid) for pid in started))
