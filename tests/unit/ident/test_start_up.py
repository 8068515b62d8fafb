"""What a command or a script loads: nothing that takes half a second and is not used."""

import subprocess
import sys

LOADED = """
import sys
import ident
from ident.cli import main

try:
    main(["run", "none.mcap"])
except SystemExit as ended:
    assert ended.code
ident.identify, ident.Arm, ident.Recording, ident.score
print(*sys.modules)
"""


def test_neither_compiler_nor_simulation_is_loaded_for_a_regression(tmp_path):
    command = [sys.executable, "-c", LOADED]
    done = subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True)
    loaded = set(done.stdout.split())
    assert "ident.workflows.run" in loaded
    assert loaded.isdisjoint({"numba", "scipy.signal", "ident.workflows.output_error.run"})
