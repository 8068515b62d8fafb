"""Processes of a search: interrupts are the command's to take, and no main module runs twice."""

import subprocess
import sys

SCRIPT = """
import signal
from ident.excitation.optimisation.workers import workers
from ident.regression.processes import started_apart
context = workers()
with started_apart():
    pool = context.Pool(1)
print(signal.SIGINT in pool.apply(signal.pthread_sigmask, (signal.SIG_BLOCK, [])))
pool.terminate()
"""


def test_workers_take_no_interrupt_and_need_no_guarded_script(tmp_path) -> None:
    (tmp_path / "script.py").write_text(SCRIPT, encoding="utf-8")
    words = [sys.executable, tmp_path / "script.py"]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=60)
    assert (done.stdout, done.stderr) == ("True\n", "")
