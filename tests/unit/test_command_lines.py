"""What every command line has: version, short options, advice, and nothing lost at `--out`."""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from typer.testing import CliRunner, Result

import ident.cli
import sim_bus.cli
import wamctl.cli
from ident.cli import main
from ident.commands.options import next_after, settings_of, with_input
from ident.commands.outputs import file_written, folder_written
from ident.recordings.loading import Reading
from wamctl.arm import command_line
from wamctl.arm.command_line import can_missing, next_step
from wamctl.arm.config import IdentificationSection, find_file, load_robot_file, shipped_file
from wamctl.arm.configuration.yaml_file import validate
from wamctl.arm.errors import ConfigurationError, DataError

PROJECT = Path(__file__).parents[2]
PROGRAMS = {"wamctl": wamctl.cli.app, "ident": ident.cli.app, "sim-bus": sim_bus.cli.app}


def started(program: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    """A command in a process of its own."""
    words = [Path(sys.executable).parent / program, *map(str, arguments)]
    return subprocess.run(words, capture_output=True, text=True, check=False)


def typed(program: str, *arguments: object, **environment: str) -> Result:
    """A command in this process, on a terminal of 80 columns."""
    told = {"COLUMNS": "80"} | environment
    return CliRunner().invoke(
        PROGRAMS[program], list(map(str, arguments)), env=told, prog_name=program
    )


def call(*arguments: object) -> int:
    with pytest.raises(SystemExit) as ended:
        main([str(a) for a in arguments])
    return int(ended.value.code or 0)


@pytest.mark.parametrize("program", PROGRAMS)
def test_version_and_help(program: str) -> None:
    assert re.fullmatch(r"wam-ident \d+\.\d+\.\d+\n", started(program, "--version").stdout)
    short, long = typed(program, "-h"), typed(program, "--help")
    assert short.stdout == long.stdout
    assert "--quiet" in short.stdout


@pytest.mark.parametrize(
    ("program", "command"),
    [("wamctl", "excite"), ("wamctl", "bench"), ("ident", "run"), ("ident", "design")],
)
def test_help_fits_80_columns_and_keeps_its_units(program: str, command: str) -> None:
    said = typed(program, command, "-h").stdout
    assert max(map(len, said.splitlines())) <= 80
    if command == "bench":
        assert "How long to measure [s]" in said


def test_similar_words_are_offered(capsys) -> None:
    assert call("run", "x.mcap", "--set", "cutof_hz=3") == 3
    assert "did you mean cutoff_hz?" in capsys.readouterr().err
    assert "did you mean run?" in typed("ident", "rum").stderr
    with pytest.raises(ConfigurationError, match=r"\(did you mean wam7\.yaml\?"):
        find_file("wam8.yaml")


def test_a_similar_key_of_a_file_is_offered(tmp_path, capsys) -> None:
    content = yaml.safe_load(shipped_file("staubli_tx40.yaml").read_text("utf-8"))
    content["robot"]["urdf"] = str(shipped_file("staubli_tx40.urdf"))
    content["robot"]["gravity"] = [0, 0, -9.81]
    path = tmp_path / "arm.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    assert call("design", "--config", path, "--out", tmp_path / "t.yaml") == 3
    assert call("run", tmp_path / "no.mcap", "--robot", path) == 6
    with pytest.raises(ConfigurationError, match="did you mean gravity_m_s2"):
        load_robot_file(path)


@pytest.mark.parametrize("command", ["run", "gap", "validate", "design"])
def test_settings_are_listed(command: str, capsys) -> None:
    assert call(command, "--set", "help") == 0
    said = capsys.readouterr().out
    assert ("patience" if command == "design" else "cutoff_hz") in said.splitlines()
    assert max(map(len, said.splitlines())) <= 80


@pytest.mark.parametrize(
    ("program", "words", "expected"),
    [
        ("wamctl", "excite --config wam7-c", "wam7-classic.yaml"),
        ("wamctl", "excite --hidden strib", "stribeck"),
        ("ident", "design --for backl", "backlash"),
        ("ident", "run --robot xmate7p.u", "xmate7p.urdf"),
    ],
)
def test_shipped_names_are_completed(program: str, words: str, expected: str) -> None:
    line = f"{program} {words}"
    given = {"COMP_WORDS": line, "COMP_CWORD": str(line.count(" "))}
    done = typed(program, **{f"_{program.upper()}_COMPLETE": "complete_bash"}, **given)
    assert expected in done.stdout.split()


def test_quiet_gives_no_advice(tmp_path) -> None:
    wrong = tmp_path / "arm.urdf"
    text = shipped_file("wam7.urdf").read_text("utf-8")
    wrong.write_text(re.sub(r'ixx="[^"]*"', 'ixx="-1"', text, count=1), encoding="utf-8")
    assert "Next: ident check-urdf" in started("ident", "check-urdf", wrong).stderr
    for arguments in (("-q", "check-urdf", wrong), ("check-urdf", wrong, "--quiet")):
        done = started("ident", *arguments)
        assert (done.returncode, done.stderr) == (3, "")
        assert "1 fault" in done.stdout


def write(folder: Path, **contents: object) -> None:
    folder.mkdir(exist_ok=True)
    for name, content in contents.items():
        (folder / f"{name}.json").write_text(json.dumps(content), encoding="utf-8")


def test_results_of_another_run_are_kept(tmp_path, capsys) -> None:
    write(tmp_path, run={"verdict": "doubtful", "seconds": 1}, model=1)
    with folder_written(tmp_path, ("run.json", "model.json"), force=False):
        write(tmp_path, run={"verdict": "trustworthy", "seconds": 1}, model=2)
    kept = tmp_path / "previous"
    assert json.loads((kept / "run.json").read_text())["verdict"] == "doubtful"
    assert (kept / "model.json").read_text() == "1"
    assert f"they are now in {kept}" in capsys.readouterr().err


def test_a_repetition_keeps_nothing(tmp_path, capsys) -> None:
    write(tmp_path, run={"verdict": "doubtful", "seconds": 1})
    with folder_written(tmp_path, ("run.json",), force=False):
        write(tmp_path, run={"verdict": "doubtful", "seconds": 2})
    assert [p.name for p in tmp_path.iterdir()] == ["run.json"]
    assert capsys.readouterr().err == ""


def test_force_keeps_nothing(tmp_path) -> None:
    write(tmp_path, run={"verdict": "doubtful"})
    with folder_written(tmp_path, ("run.json",), force=True):
        write(tmp_path, run={"verdict": "trustworthy"})
    assert [p.name for p in tmp_path.iterdir()] == ["run.json"]


def test_a_failed_run_leaves_results_alone_and_a_refused_one_keeps_them(tmp_path) -> None:
    write(tmp_path, run={"verdict": "doubtful"}, model=1)
    names = ("run.json", "model.json")
    with pytest.raises(DataError), folder_written(tmp_path, names, force=False):
        raise DataError("too short")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["model.json", "run.json"]

    def refuse() -> None:
        write(tmp_path, run={"verdict": "refused"})
        (tmp_path / "model.json").unlink()
        raise DataError("refused")

    with pytest.raises(DataError), folder_written(tmp_path, names, force=False):
        refuse()
    assert (tmp_path / "previous" / "model.json").read_text() == "1"


def test_files_of_a_folder_are_kept_in_theirs(tmp_path) -> None:
    write(tmp_path, plan={"motion": 1})
    write(tmp_path / "models", a=1, b=2)
    with folder_written(tmp_path, ("plan.json", "models"), force=False):
        write(tmp_path, plan={"motion": 2})
        write(tmp_path / "models", a=3, b=2)
    kept = [p.relative_to(tmp_path / "previous") for p in (tmp_path / "previous").rglob("*.json")]
    assert sorted(map(str, kept)) == ["models/a.json", "plan.json"]
    assert (tmp_path / "previous" / "models" / "a.json").read_text() == "1"


def test_a_missing_library_of_the_system_is_named(capsys) -> None:
    lacking = "libgomp.so.1: cannot open shared object file: No such file or directory"
    with pytest.raises(SystemExit) as ended, command_line.system_libraries("ident"):
        raise ImportError(lacking)
    assert ended.value.code == 3
    assert capsys.readouterr().err == (
        "ident: the system's library libgomp.so.1 is not installed: install its package"
        " (Debian and Ubuntu: apt install libgomp1).\n"
    )
    with pytest.raises(ImportError, match="no module"), command_line.system_libraries("ident"):
        raise ImportError("no module of that name")


def test_what_needs_the_can_libraries_says_where_they_are(monkeypatch) -> None:
    assert can_missing("wamctl") == ""
    monkeypatch.setattr(command_line, "find_spec", lambda name: None)
    assert can_missing("wamctl") == (
        "wamctl: the CAN libraries (can and canopen) are not installed:"
        " pip install 'wam-ident[can]'.\n"
    )


def remark(code: str, advice: str = "Record again.") -> dict:
    return {"code": code, "joints": [], "sentence": "", "advice": advice}


@pytest.mark.parametrize(
    ("verdict", "remarks", "said"),
    [
        ("trustworthy", [remark("names_matched", "")], "ident validate b.mcap"),
        ("doubtful", [remark("large_error")], "ident gap a.mcap"),
        ("doubtful", [remark("large_error"), remark("units")], "follow the advice above"),
        ("doubtful", [remark("sign"), remark("cutoff", "")], "follow the advice above"),
    ],
)
def test_the_next_step_follows_from_the_verdict(verdict, remarks, said, capsys) -> None:
    next_after(verdict, remarks, ["ident validate b.mcap"], [Path("a.mcap")])
    assert capsys.readouterr().err.startswith(f"Next: {said}")


def test_the_next_step_can_be_pasted_into_a_shell(capsys) -> None:
    reading = Reading(joint_states="/arm/states", torque="measured", rules=(("fer", "panda"),))
    changes = settings_of(None, ["terms=viscous, coulomb", "torque_unit=A"])
    logs, robot = [Path("my logs/a.mcap")], Path("my arm.urdf")
    next_step("ident gap", *with_input(logs, robot, reading, changes))
    assert shlex.split(capsys.readouterr().err.removeprefix("Next: ")) == [
        *("ident", "gap", "my logs/a.mcap", "--robot", "my arm.urdf"),
        *("--joint-states", "/arm/states", "--torque", "measured", "--rename", "fer=panda"),
        *("--set", "terms=viscous,coulomb", "--set", "torque_unit=A"),
    ]
    assert with_input([Path("a.mcap")], None, Reading()) == [Path("a.mcap")]


def test_a_setting_with_several_numbers_is_kept_as_it_was_given() -> None:
    """Joined as words, numbers ended the command in a bug after its results were written."""
    given = settings_of(None, ["gains_nm_per_a=[1.5, 2.0]"])
    _, word, text = with_input([Path("a.mcap")], None, Reading(), given)
    assert (word, text) == ("--set", "gains_nm_per_a=1.5,2.0")
    again = validate(IdentificationSection, settings_of(None, [str(text)]), "settings")
    assert list(again.gains_nm_per_a or ()) == [1.5, 2.0]


def test_a_replaced_file_is_kept_beside(tmp_path, capsys) -> None:
    out = tmp_path / "arm.urdf"
    out.write_text("mine", encoding="utf-8")
    with file_written(out, force=False):
        out.write_text("another", encoding="utf-8")
    assert (tmp_path / "arm.previous.urdf").read_text("utf-8") == "mine"
    assert "arm.previous.urdf" in capsys.readouterr().err
    with file_written(out, force=False):
        out.write_text("another", encoding="utf-8")
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize("command", ["run", "gap", "design", "simulate", "plan", "weigh", "fleet"])
def test_out_is_checked_before_the_work(command: str, tmp_path, capsys) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    out = tmp_path / "file" / "below"
    needed = {
        "design": ["--config", "wam7.yaml"],
        "simulate": ["--model", tmp_path / "no.yaml"],
        "plan": [tmp_path / "no.mcap", "--config", "wam7.yaml", "--gap", tmp_path],
        "weigh": [tmp_path / "no.mcap", "--plan", tmp_path],
    }.get(command, [tmp_path / "no.mcap"])
    assert call(command, *needed, "--out", out) == 6
    assert str(out) in capsys.readouterr().err


@pytest.mark.parametrize("command", ["import", "simulate"])
def test_a_log_is_written_under_the_name_of_one(command: str, tmp_path, capsys) -> None:
    for name, advised in (("foo.csv", "foo.mcap"), ("foo", "foo.mcap")):
        out = tmp_path / name
        needed = {
            "simulate": ["--model", tmp_path / "no.yaml"],
            "import": [tmp_path / "no.csv", "--map", "xmate7p-map.yaml"],
        }[command]
        assert call(command, *needed, "--out", out) == 6
        assert capsys.readouterr().err == (
            f"ident: {out} is to hold a log, whose name ends in .mcap: write --out"
            f" {tmp_path / advised}.\n"
        )
        assert not out.exists()


def test_shipped_files_fit_their_schemas() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    kinds = {"arm": ["wam7", "wam7-classic"], "robot": ["xmate7p"], "mapping": ["xmate7p-map"]}
    kinds |= {"trajectory": ["wam7-excitation"], "hidden": ["hidden/stribeck"]}
    for kind, names in kinds.items():
        schema = json.loads(shipped_file(f"schema/{kind}.schema.json").read_text("utf-8"))
        for name in names:
            content = yaml.safe_load(shipped_file(f"{name}.yaml").read_text("utf-8"))
            jsonschema.validate(content, schema)
            with pytest.raises(jsonschema.ValidationError):
                jsonschema.validate(content | {"nonsense": 1}, schema)
