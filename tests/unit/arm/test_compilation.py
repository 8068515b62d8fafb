"""Compiled functions are kept on disk; two processes that begin together compute the same."""

import os
import subprocess
import sys
import time
from pathlib import Path

SLOW = """
import pathlib, time
from numba.core.caching import IndexDataCacheFile
save = IndexDataCacheFile._save_data
def slowly(self, *a):
    pathlib.Path("begun").touch()
    time.sleep(1.0)
    save(self, *a)
IndexDataCacheFile._save_data = slowly
"""
CALL = "import rise; print(rise.rise(1.0))"


def source(step: float) -> str:
    return (
        "from wamctl.arm.compilation import compiled\n\n\n"
        f"@compiled\ndef rise(x):\n    return x + {step}\n"
    )


def start(folder: Path, code: str) -> subprocess.Popen[str]:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), *sys.path])}
    return subprocess.Popen(
        [sys.executable, "-c", code], cwd=folder, env=environment, stdout=subprocess.PIPE, text=True
    )


def test_nobody_reads_the_code_of_before_while_another_process_compiles(tmp_path):
    (tmp_path / "rise.py").write_text(source(1.0))
    assert start(tmp_path, CALL).communicate()[0] == "2.0\n"
    (tmp_path / "rise.py").write_text(source(20.0))
    first = start(tmp_path, SLOW + CALL)
    end = time.monotonic() + 60.0
    while not (tmp_path / "begun").exists():
        assert time.monotonic() < end
        time.sleep(0.01)
    second = start(tmp_path, CALL)
    assert second.communicate()[0] == "21.0\n"
    assert first.communicate()[0] == "21.0\n"


def test_a_process_that_dies_while_it_compiles_keeps_nobody_waiting(tmp_path):
    (tmp_path / "rise.py").write_text(source(1.0))
    dies = SLOW.replace("time.sleep(1.0)", "import os; os._exit(3)")
    first = start(tmp_path, dies + CALL)
    assert (first.communicate()[0], first.returncode) == ("", 3)
    assert start(tmp_path, CALL).communicate()[0] == "2.0\n"
