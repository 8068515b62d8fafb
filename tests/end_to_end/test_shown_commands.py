"""Commands that the documentation shows exist and take the options given; those of blocks run."""

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pytest
import typer
import yaml
from typer.core import TyperGroup

import ident.cli
import sim_bus.cli
import wamctl.cli
from ident.cli import main
from ident.importers.mapping import Mapping
from ident.workflows.fleet import fleet as work
from sim_bus.faults.script import FaultScript
from sim_bus.hidden_effects.catalogue import HiddenFile
from tests.end_to_end.stand_ins import bring
from wamctl.arm.config import ServoSection

PROJECT = Path(__file__).parents[2]
APPS = {
    "ident": typer.main.get_command(ident.cli.app),
    "sim-bus": typer.main.get_command(sim_bus.cli.app),
    "wamctl": typer.main.get_command(wamctl.cli.app),
}
(USAGE_ERROR,) = (c for c in typer.BadParameter.__bases__ if issubclass(c, Exception))
"""What all refusals of a command line are; typer gives it no name of its own."""

OPTION = r"--[a-z]+ [^-`\s]"
"""Without an option and its value, it is a command's name rather than one to be typed."""

COMMAND = re.compile(rf"(?:^ *|`)((?:wamctl|ident|sim-bus) [a-z]+ [^`\n]*{OPTION}[^`\n]*)", re.M)


BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.M | re.S)

NOT_HERE = {
    r"\./scripts/(setup|test)\b": "what runs this test",
    "pytest tests/unit$": "a part of what runs this test",
    "source .venv/": "this test runs in that environment",
    "pip install ": "changes the environment, by the network",
    "ros2 bag record ": "needs ROS 2 and an arm",
    "wamctl .* --live ": "in real time, on a fixed port; see tests/bus/canopen/test_live_run.py",
    "ident watch ws://": "needs that live server; see tests/unit/watch",
    "wamctl .* wam7-classic.yaml ": "an arm of seven joints; see tests/bus/puck",
    "scripts/vcan-kernel ": "compiles a kernel",
    "VCAN_KERNEL=": "needs that kernel, and its real time",
    "python scripts/benchmarks/null_arms.py ": "ten logs of the whole WAM: some minutes",
    "for log in nulls/": "ten searches of the whole WAM: a quarter of an hour",
}
"""Lines of blocks that are parsed only, and why."""


YAML = {"time": Mapping, "servo": ServoSection, "faults": FaultScript, "effects": HiddenFile}
"""By a key of a block which file it shows a part of."""


def pages() -> dict[str, str]:
    """Name and text of all that readers read; `configs/README.md` first, which records a bag."""
    listed = subprocess.run(
        ["git", "ls-files", "CONTRIBUTING.md", "*README.md", "docs/*.md"],
        cwd=PROJECT,
        capture_output=True,
        text=True,
        check=True,
    )
    names = sorted(listed.stdout.split(), key=lambda name: name != "configs/README.md")
    return {name: (PROJECT / name).read_text("utf-8") for name in names}


def shown() -> list[tuple[str, str]]:
    """Page and command, of blocks and of words in text."""
    return [(name, c) for name, text in pages().items() for c in COMMAND.findall(text)]


def lines_of_blocks() -> Iterator[tuple[str, str]]:
    """Page and line of all shell blocks, without comments; a loop is in one line."""
    for name, text in pages().items():
        for language, block in BLOCK.findall(text):
            for line in block.splitlines() if not language else ():
                if line and not line.startswith("#"):
                    yield name, line


def parse(command: str) -> None:
    """Parses a command as its program would, without running it.

    Raises:
        USAGE_ERROR: the program would refuse it.
    """
    program, *arguments = shlex.split(command, comments=True)
    group = APPS[program]
    assert isinstance(group, TyperGroup)
    with group.make_context(program, list(arguments)) as context:
        name, found, rest = group.resolve_command(context, arguments)
        assert found is not None
        found.make_context(name, rest, parent=context)


def test_every_command_is_accepted() -> None:
    commands = shown()
    assert {"ident", "wamctl", "sim-bus"} == {c.split()[0] for _, c in commands}
    refused = []
    for readme, command in commands:
        try:
            parse(command)
        except USAGE_ERROR as error:
            refused.append(f"{readme}: {command}: {error}")
    assert refused == []


@pytest.mark.parametrize(
    ("command", "refusal"),
    [
        ("ident rum log.mcap", "No such command 'rum'"),
        ("ident run log.mcap --robott arm.urdf", "No such option: --robott"),
        ("ident export model.yaml --to sdf --out arm.sdf", "sdf"),
    ],
)
def test_what_a_program_would_refuse_is_seen(command: str, refusal: str) -> None:
    with pytest.raises(USAGE_ERROR) as error:
        parse(command)
    assert refusal in str(error.value)


def run(line: str, folder: Path) -> str:
    """Runs a line of a block in a folder; what it says if it fails, else nothing."""
    if line.startswith("ident ") and "$" not in line:
        with pytest.raises(SystemExit) as ended:
            main(shlex.split(line, comments=True)[1:])
        return f"exit code {ended.value.code}" if ended.value.code else ""
    words = ["bash", "-c", line]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    return done.stderr if done.returncode else ""


def serve(line: str, folder: Path) -> str:
    """Starts a server, and stops it when it says that it is ready."""
    words = shlex.split(line.replace("/tmp/", f"{folder}/"))
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        ready = server.stdout.readline()
        server.terminate()
    return "" if "ready" in ready and not server.returncode else f"{ready}{server.returncode}"


def assigned(line: str, folder: Path) -> str:
    """A variable that names a file of an installed package; the small arm stands in for it."""
    name, command = line.split("=", 1)
    words = ["bash", "-c", f"ls {command}"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    os.environ[name] = str(folder / "my_arm.urdf")
    return done.stderr


@contextmanager
def one_thread() -> Iterator[Executor]:
    """In the place of processes, each of which would load all libraries again."""
    with ThreadPoolExecutor(1) as pool:
        yield pool


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """Where a reader works, with what the pages take for granted."""
    bring(tmp_path)
    for name in ("scripts", "configs"):
        (tmp_path / name).symlink_to(PROJECT / name)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}:{os.environ['PATH']}")
    monkeypatch.setenv("URDF", "")
    monkeypatch.setattr(work, "engine", lambda scheduler, workers: (one_thread, 4))
    return tmp_path


def test_every_line_of_a_shell_block_runs(folder, capsys) -> None:
    failed = []
    for line, page in {line: page for page, line in lines_of_blocks()}.items():
        if any(re.match(pattern, line) for pattern in NOT_HERE):
            continue
        if line.startswith("wamctl excite"):  # which never writes over a log
            (folder / "log.mcap").unlink(missing_ok=True)
        how = serve if line.startswith("sim-bus serve") else assigned if "=$(" in line else run
        said = how(line, folder)
        if said:
            failed.append(f"{page}: {line}: {said} {capsys.readouterr().err[-300:]}")
    assert failed == []


@pytest.mark.parametrize("pattern", NOT_HERE)
def test_what_does_not_run_here_is_still_shown(pattern) -> None:
    assert any(re.match(pattern, line) for _, line in lines_of_blocks())


def test_other_blocks_hold() -> None:
    """Mappings, settings, faults and hidden effects fit the models of their files."""
    seen = []
    for page, text in pages().items():
        for language, block in BLOCK.findall(text):
            if language == "yaml":
                content = yaml.safe_load(block)
                kind = next(kind for key, kind in YAML.items() if key in content)
                kind.model_validate(content.get("servo", content))
                seen.append(kind)
            elif language == "toml":
                assert block in (PROJECT / "scripts/examples/eddy_brake/pyproject.toml").read_text()
            else:
                assert language in ("", "python"), f"{page}: no test runs blocks of {language}"
    assert set(seen) == set(YAML.values())
