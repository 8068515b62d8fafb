"""Foreign tables: units, motors, joined files, every kind of file, and all faults at once."""

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io
import typer
import yaml
from typer.testing import CliRunner

from ident.commands.import_table import import_table
from ident.importers.recording import import_recording
from wamctl.arm.config import find_file
from wamctl.arm.errors import ConfigurationError, DataError, UserError
from wamctl.arm.recording import read_recording

SAMPLES = 50
T = np.arange(SAMPLES) * 0.004
Q = np.random.default_rng(0).normal(size=(SAMPLES, 2))
TAU = np.random.default_rng(1).normal(size=(SAMPLES, 2))
BASIC: dict[str, Any] = {
    "joints": ["a", "b"],
    "time": {"column": "t"},
    "position": {"columns": ["q1", "q2"]},
    "effort": {"columns": ["u1", "u2"]},
}


def table(path: Path, columns: dict[str, np.ndarray], delimiter: str = ",") -> Path:
    rows = np.column_stack(list(columns.values()))
    lines = [delimiter.join(columns)] + [delimiter.join(map(repr, r)) for r in rows.tolist()]
    path.write_text("\n".join(lines) + "\n")
    return path


def basic_table(folder: Path) -> Path:
    columns = {"t": T, "q1": Q[:, 0], "q2": Q[:, 1], "u1": TAU[:, 0], "u2": TAU[:, 1]}
    return table(folder / "data.csv", columns)


def mapping(folder: Path, content: dict[str, Any]) -> Path:
    path = folder / "map.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def imported(source: Path, content: dict[str, Any]) -> Any:
    out = source.parent / "log.mcap"
    import_recording(source, mapping(source.parent, content), out)
    return read_recording(out)


def refused(source: Path, content: dict[str, Any], kind: type[UserError]) -> str:
    out = source.parent / "log.mcap"
    with pytest.raises(kind) as caught:
        import_recording(source, mapping(source.parent, content), out)
    assert not out.exists()
    return str(caught.value)


def test_columns_become_a_log(tmp_path: Path) -> None:
    recording = imported(basic_table(tmp_path), BASIC)
    assert recording.joint_names == ("a", "b")
    np.testing.assert_array_equal(recording.q, Q)
    np.testing.assert_array_equal(recording.effort, TAU)
    np.testing.assert_array_equal(recording.stamp_ns, np.arange(SAMPLES) * 4_000_000)
    assert recording.command is None
    assert list(recording.attachments) == ["mapping.yaml"]
    assert recording.metadata["data.csv"].startswith("sha256 ")


@pytest.mark.parametrize(
    "changed",
    [
        lambda text: text.replace(",", ";").replace(".", ","),
        lambda text: text.replace(",", "\t"),
        lambda text: "# exported by a tool, version 2\n% all in SI\n" + text,
        lambda text: "# " + text,
        lambda text: text.replace("\n", "\ns,rad,rad,N m,N m\n", 1),
        lambda text: "#made by hand\n" + text.replace("\n", "\ns,rad,rad,N m,\n", 1),
    ],
    ids=["decimal commas", "tabs", "comments", "names in a comment", "units", "comment and units"],
)
def test_the_head_of_a_table_tells_how_it_is_written(tmp_path: Path, changed: Any) -> None:
    wanted = imported(basic_table(tmp_path), BASIC)
    source = tmp_path / "data.csv"
    source.write_text(changed(source.read_text()))
    found = imported(source, BASIC)
    np.testing.assert_array_equal(found.q, wanted.q)
    np.testing.assert_array_equal(found.effort, wanted.effort)


def test_numbered_columns_of_a_table_without_header(tmp_path: Path) -> None:
    path = tmp_path / "data.txt"
    np.savetxt(path, np.column_stack([T * 1e3, np.degrees(Q), 1e3 * TAU]), delimiter=";")
    content = {
        "joints": ["a", "b"],
        "header": False,
        "delimiter": ";",
        "rows": {"first": 3, "last": 40},
        "time": {"column": 1, "unit": "ms"},
        "position": {"columns": [3, 2], "unit": "deg", "scale": [1, -2], "offset": [0, 0.5]},
        "command": {"columns": [4, 5], "unit": "mN m"},
    }
    recording = imported(path, content)
    np.testing.assert_allclose(recording.q, Q[2:40, ::-1] * [1, -2] + [0, 0.5])
    assert recording.effort is None
    np.testing.assert_allclose(recording.command.effort, TAU[2:40])
    assert recording.stamp_ns[0] == 8_000_000


def test_motors_become_joints_and_power_is_kept(tmp_path: Path) -> None:
    matrix = np.array([[10.0, 0.0], [4.0, -8.0]])
    motor, motor_torque = Q @ matrix.T, TAU @ np.linalg.inv(matrix)
    columns = {"m1": motor[:, 0], "m2": motor[:, 1], "w1": motor[:, 0], "w2": motor[:, 1]}
    angle = table(tmp_path / "angle.csv", columns)
    table(tmp_path / "torque.csv", {"m1": motor_torque[:, 0], "m2": motor_torque[:, 1]})
    both = ["m1", "m2"]
    content = {
        "joints": ["a", "b"],
        "time": {"rate_hz": 250},
        "motor_from_joint": matrix.tolist(),
        "position": {"columns": both, "side": "motor"},
        "velocity": {"columns": ["w1", "w2"], "side": "motor", "unit": "rpm"},
        "effort": {"columns": both, "side": "motor", "file": "torque.csv"},
    }
    recording = imported(angle, content)
    np.testing.assert_allclose(recording.q, Q, atol=1e-12)
    np.testing.assert_allclose(recording.qd, Q * 2 * np.pi / 60, atol=1e-12)
    np.testing.assert_allclose(recording.effort, TAU, atol=1e-12)
    assert set(recording.metadata) == {"angle.csv", "torque.csv"}
    own = {"columns": both, "side": "motor", "file": "torque.csv",
           "joint_from_motor": [[1, 1], [0, 2]]}  # fmt: skip
    recording = imported(angle, content | {"effort": own})
    expected = np.column_stack([motor_torque.sum(axis=1), 2 * motor_torque[:, 1]])
    np.testing.assert_allclose(recording.effort, expected, atol=1e-12)


def save_npz(path: Path, content: dict[str, Any]) -> None:
    np.savez(path, **content)


def save_mat(path: Path, content: dict[str, Any]) -> None:
    scipy.io.savemat(path, content)


def save_mat_73(path: Path, content: dict[str, Any]) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in content.items():
            file[name] = np.atleast_2d(value).T
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(512))


def test_a_file_for_each_joint(tmp_path: Path) -> None:
    """As recorders write that take one joint after the other."""
    path = tmp_path / "first.csv"
    for name, k in (("first", 0), ("second", 1)):
        np.savetxt(
            tmp_path / f"{name}.csv", np.column_stack([T, Q[:, k], TAU[:, k]]), delimiter=","
        )
    both = ["first.csv", "second.csv"]
    content = BASIC | {
        "header": False,
        "time": {"column": 1},
        "position": {"file": both, "columns": [2, 2]},
        "effort": {"file": both, "columns": [3, 3]},
    }
    recording = imported(path, content)
    np.testing.assert_allclose(recording.q, Q)
    np.testing.assert_allclose(recording.effort, TAU)
    content["effort"] = {"file": both, "columns": [3, 3, 3]}
    with pytest.raises(ConfigurationError, match="2 files for 3 columns, not one for each"):
        imported(path, content)


def test_the_usual_word_for_an_effort_is_understood(tmp_path: Path) -> None:
    content = {k: v for k, v in BASIC.items() if k != "effort"} | {"torque": BASIC["effort"]}
    with pytest.raises(ConfigurationError, match=r"torque: unknown key; did you mean effort\?"):
        imported(tmp_path / "table.csv", content)


def test_an_object_of_matlab_is_told_as_one(tmp_path: Path) -> None:
    path = tmp_path / "d.mat"
    save_mat_73(path, {"t": T, "u1": TAU[:, 0], "u2": TAU[:, 1], "log": np.zeros(6)})
    with h5py.File(path, "r+") as file:
        file["log"].attrs["MATLAB_object_decode"] = 3
        file["log"].attrs["MATLAB_class"] = np.bytes_(b"table")
    with pytest.raises(ConfigurationError, match=r"log \(an object of class table, which only"):
        imported(path, BASIC | {"position": {"columns": "pos"}})


@pytest.mark.parametrize(
    ("name", "save"), [("d.npz", save_npz), ("d.mat", save_mat), ("d.mat", save_mat_73)]
)
def test_arrays_of_binary_files(tmp_path: Path, name: str, save: Any) -> None:
    path = tmp_path / name
    save(path, {"t": T, "pos": Q, "u1": TAU[:, 0], "u2": TAU[:, 1]})
    content = BASIC | {"position": {"columns": "pos"}}
    recording = imported(path, content)
    np.testing.assert_array_equal(recording.q, Q)
    np.testing.assert_array_equal(recording.effort, TAU)
    save(path, {"t": T, "pos": Q.T, "u1": TAU[:, 0], "u2": TAU[:, 1]})
    np.testing.assert_array_equal(imported(path, content).q, Q)
    save(path, {"t": T, "pos": np.zeros((50, 3)), "u1": TAU[:, 0], "u2": TAU[:, 1]})
    (tmp_path / "log.mcap").unlink()
    assert refused(path, content, ConfigurationError) == (
        f"{tmp_path / 'map.yaml'}: position.columns: {name} has there shape (50, 3) for 2 joints"
        " (entries chooses columns of an array)."
    )


@pytest.mark.parametrize(
    ("head", "cell", "end", "form"),
    [
        ("", "%16.7e", "", {"header": False, "delimiter": " "}),
        ("# t\tq1\tq2\tu1\tu2\n", "%.9g", "\t", {"delimiter": "\t"}),
        ("made by hand\n\nt;q1;q2;u1;u2\n", "%.9g", ";", {"delimiter": ";", "skip": 2}),
    ],
)
def test_forms_of_text_tables(
    tmp_path: Path, head: str, cell: str, end: str, form: dict[str, Any]
) -> None:
    rows = np.column_stack([T, Q, TAU]).tolist()
    lines = [end.join(cell % x for x in row) for row in rows]
    (tmp_path / "data.txt").write_text(head + "\n".join(lines) + "\n")
    columns: dict[str, Any] = {
        "time": {"column": 1}, "position": {"columns": [2, 3]}, "effort": {"columns": [4, 5]},
    }  # fmt: skip
    content = BASIC | form | (columns if not form.get("header", True) else {})
    np.testing.assert_allclose(imported(tmp_path / "data.txt", content).q, Q, atol=1e-6)


@pytest.mark.parametrize("kind", ["mat", "npy"])
def test_a_quantity_and_the_clock_in_files_of_their_own(tmp_path: Path, kind: str) -> None:
    for name, values in {"t": T.reshape(-1, 1), "q": Q, "tau": TAU}.items():
        if kind == "mat":
            scipy.io.savemat(tmp_path / f"{name}.mat", {name: values})
        else:
            np.save(tmp_path / f"{name}.npy", values)
    content = BASIC | {
        "time": {"file": f"t.{kind}", "column": "t"},
        "position": {"columns": "q"},
        "effort": {"file": f"tau.{kind}", "columns": "tau"},
    }
    found = imported(tmp_path / f"q.{kind}", content)
    np.testing.assert_allclose(found.stamp_ns, T * 1e9)
    np.testing.assert_allclose(found.q, Q)
    np.testing.assert_allclose(found.effort, TAU)
    assert set(found.metadata) >= {f"{name}.{kind}" for name in ("q", "t", "tau")}
    if kind == "npy":  # an input between two states each
        np.save(tmp_path / "tau.npy", TAU[:-1])
        found = imported(tmp_path / "q.npy", content | {"rows": {"last": SAMPLES - 1}})
        np.testing.assert_allclose(found.q, Q[:-1])


@pytest.mark.parametrize("version", [5, 7.3])
def test_structures_of_matlab_files(tmp_path: Path, version: float) -> None:
    path = tmp_path / "run.mat"
    if version == 5:
        save_mat(path, {"log": {"q": Q, "u": TAU, "t": T}})
    else:
        save_mat_73(path, {"log/q": Q, "log/u": TAU, "log/t": T})
    content = {
        "joints": ["a", "b"],
        "time": {"column": "log.t"},
        "position": {"columns": "log.q"},
        "effort": {"columns": "log.u"},
    }
    np.testing.assert_array_equal(imported(path, content).effort, TAU)


def test_every_fault_of_a_mapping_at_once(tmp_path: Path) -> None:
    content = {
        "joints": ["a", "b"],
        "time": {"column": "t", "rate_hz": 3},
        "rows": {"first": 9, "last": 3},
        "position": {"columns": ["q1", "q2"], "unit": "furlong"},
        "colour": "red",
    }
    assert refused(basic_table(tmp_path), content, ConfigurationError) == (
        f"{tmp_path / 'map.yaml'}: 4 faults:\n"
        "  - rows: last 3 lies before first 9\n"
        "  - time: give either column or rate_hz\n"
        "  - position.unit: 'furlong' should be 'rad', 'deg', 'rev', 'm' or 'mm'\n"
        "  - colour: unknown key"
    )
    content = {
        "header": False,
        "time": {"rate_hz": 3},
        "motor_from_joint": [[1, 0], [2, 0]],
        "position": {"columns": ["q1", 2], "scale": [1, 2, 3]},
        "effort": {"columns": [1, 2], "joint_from_motor": [[1, 2]]},
        "joints": ["a", "b"],
    }
    assert refused(basic_table(tmp_path), content, ConfigurationError) == (
        f"{tmp_path / 'map.yaml'}: 4 faults:\n"
        "  - position.columns: the table has no header, so 'q1' is no column (give its number)\n"
        "  - position.scale: 3 entries for 2 joints\n"
        "  - effort.joint_from_motor: 1 rows of 2 entries for 2 joints\n"
        "  - motor_from_joint: the matrix cannot be inverted (condition number inf)"
    )
    assert refused(
        basic_table(tmp_path),
        {"time": {"rate_hz": 3}, "position": {"columns": ["q1"], "side": "motor"}},
        ConfigurationError,
    ) == (
        f"{tmp_path / 'map.yaml'}: 3 faults:\n"
        "  - give effort or command (a torque), or command_position\n"
        "  - give joints, or the robot whose joints they are\n"
        "  - position.side: motor, but motor_from_joint is missing"
    )


@pytest.mark.parametrize("unit", ["A", "mA"])
def test_currents_go_in_without_a_unit(tmp_path: Path, unit: str) -> None:
    effort = BASIC["effort"] | {"unit": unit}
    assert refused(basic_table(tmp_path), BASIC | {"effort": effort}, ConfigurationError) == (
        f"{tmp_path / 'map.yaml'}: effort.unit: '{unit}' is of a current: leave unit out, scale the"
        " columns to ampere, and let `--set torque_unit=A` (for `ident run` and `ident gap`) or"
        " `torque_unit: A` (under identification in the arm's file) estimate the drives' gains."
    )


def test_every_column_that_is_missing_at_once(tmp_path: Path) -> None:
    source = basic_table(tmp_path)
    table(tmp_path / "short.csv", {"u1": T[:9], "u2": T[:9]})
    content = BASIC | {
        "time": {"column": "time"},
        "position": {"columns": ["q1", "q3"]},
        "velocity": {"columns": ["q1", "q2"]},
        "effort": {"columns": ["u1", "u2"], "file": "short.csv"},
    }
    names = "its columns are t, q1, q2, u1, u2"
    assert refused(source, content, ConfigurationError) == (
        f"{tmp_path / 'map.yaml'}: 3 faults:\n"
        f"  - position.columns: data.csv has no column 'q3'; {names}\n"
        f"  - time.column: data.csv has no column 'time'; {names}\n"
        "  - the columns have different numbers of rows: velocity 50, effort 9 (rows.last: 9"
        " takes those that all have)"
    )


def test_a_row_for_each_channel_is_turned(tmp_path: Path) -> None:
    """As Simulink writes them: time first, one row a channel."""
    t = np.arange(50) / 100
    q = np.sin(t[:, None] + [0.0, 1.0])
    path = tmp_path / "data.npz"
    np.savez(path, ans=np.vstack([t, q.T, 2 * q.T]))
    content = {
        "joints": ["q1", "q2"],
        "time": {"rate_hz": 100},
        "position": {"columns": "ans", "entries": [2, 3]},
        "effort": {"columns": "ans", "entries": [5, 4]},
    }
    made = imported(path, content)
    np.testing.assert_allclose(made.q, q)
    np.testing.assert_allclose(made.effort, 2 * q[:, ::-1])


def test_white_space_where_commas_were_expected(tmp_path: Path) -> None:
    path = tmp_path / "data.txt"
    path.write_text("0.0 1.0 2.0\n1.0 1.0 2.0\n")
    content = BASIC | {"header": False, "time": {"column": 1}}
    content |= {p: {"columns": [1]} for p in ("position", "effort")} | {"joints": ["q1"]}
    assert refused(path, content, DataError).endswith("write `delimiter: ' '`.")


def test_a_cell_that_is_no_number(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text("t,q1,q2,u1,u2\n0,1,2,3,4\n\n1,1,two,3,4\n2,1,2,3,4\n")
    assert refused(path, BASIC, DataError) == (
        f"{path}, line 4, column 'q2': 'two' is not a number; a line that was torn can be deleted:"
        " what it leaves is told as missing."
    )
    path.write_text("t,q1,q2,u1,u2\n0,1,2,3,4\n1,1,2\n")
    assert refused(path, BASIC, DataError) == (
        f"{path}, line 3: 3 columns, so that column 'u1' is missing; a last row that was cut off"
        " is left out by rows.last: 1."
    )
    path.write_text("t,q1,q2,u1,u2\n0,1,2,3,4\n1,1,2,nan,inf\n")
    assert refused(path, BASIC, DataError) == (
        f"{path}: effort is not finite in 2 cells, the first in row 2, joint 1;"
        " choose other rows in the mapping."
    )
    path.write_text("t,q1,q2,u1,u2\n0,1,2,3,4\n1,1,1e154,3,4\n")
    assert refused(path, BASIC, DataError).startswith(f"{path}: position of b is 1e+154 in row 2")
    path.write_text("t,q1,q2,u1,u2\n0,1,2,3,4\n1,1,2,-2e9,4\n")
    assert refused(path, BASIC, DataError).startswith(f"{path}: effort of a is -2e+09 in row 2")


@pytest.mark.parametrize("clock", ["column", "rate"])
def test_a_few_rows_that_are_not_finite_are_left_out_and_told(tmp_path: Path, clock: str) -> None:
    path, where, out = tmp_path / "data.csv", tmp_path / "map.yaml", tmp_path / "data.mcap"
    cells = [f"{0.01 * k:.2f},{k},2,3,4" for k in range(40)]
    cells[7], cells[30] = "0.07,7,2,nan,4", "0.30,30,inf,3,4"
    path.write_text("t,q1,q2,u1,u2\n" + "\n".join(cells) + "\n")
    plan = BASIC if clock == "column" else BASIC | {"time": {"rate_hz": 100}}
    where.write_text(yaml.safe_dump(plan))
    app = typer.Typer()
    app.command()(import_table)
    done = CliRunner().invoke(app, [str(path), "--map", str(where), "--out", str(out)])
    assert done.exit_code == 0, done.output
    assert "Left out: 2 rows have cells that are not finite: the first is row 8." in done.stdout
    made = read_recording(out)
    kept = np.delete(np.arange(40), [7, 30])
    np.testing.assert_array_equal(made.q[:, 0], kept)
    np.testing.assert_allclose(made.stamp_ns * 1e-9, 0.01 * kept, atol=1e-9)


def test_a_last_row_that_was_cut_off_can_be_left_out(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text("t,q1,q2,u1,u2\n0,1,2,3,4\n1,1,2,3,4\n2,1,\n")
    assert "left out by rows.last: 2" in refused(path, BASIC, DataError)
    assert len(imported(path, BASIC | {"rows": {"last": 2}}).q) == 2


def test_tables_that_cannot_be_read(tmp_path: Path) -> None:
    path = tmp_path / "no.csv"
    assert refused(path, BASIC, DataError) == f"{path} does not exist: give the table to import."
    for name in ("x.npz", "x.mat", "x.csv"):
        path = tmp_path / name
        path.write_bytes(b"\xff\xfd\x00\x81 garbage")
        assert refused(path, BASIC, DataError).startswith(f"{path} is not a readable ")
    path = tmp_path / "text.npz"
    np.savez(path, t=T, q1=np.array(["x"]), q2=T, u1=T, u2=T)
    assert refused(path, BASIC, DataError) == f"{path}: 'q1' does not hold numbers."


def test_rows_and_times_that_do_not_serve(tmp_path: Path) -> None:
    source = basic_table(tmp_path)
    assert refused(source, BASIC | {"rows": {"first": 51}}, DataError) == (
        f"{source} has 50 rows; rows.first is 51."
    )
    columns = {"t": 1e10 + T, "q1": T, "q2": T, "u1": T, "u2": T}
    source = table(tmp_path / "late.csv", columns)
    assert refused(source, BASIC, DataError) == (
        f"{source}: the time column runs to 1e+10 s; a log holds 0 s to 2147483648 s."
    )


def test_times_that_count_from_a_trigger_begin_at_the_first(tmp_path: Path) -> None:
    columns = {"t": T - 0.1, "q1": T, "q2": T, "u1": T, "u2": T}
    stamps = imported(table(tmp_path / "early.csv", columns), BASIC).stamp_ns
    assert stamps[0] == 0
    assert stamps[-1] == pytest.approx(0.196e9, abs=1.0)


def table_of_seven(folder: Path) -> tuple[Path, dict[str, Any]]:
    """A table of an arm with seven joints, and what its columns are."""
    names = {place: [f"{place}{k}" for k in range(1, 8)] for place in ("position", "effort")}
    columns = dict.fromkeys([*names["position"], *names["effort"]], T)
    source = table(folder / "data.csv", columns)
    return source, {place: {"columns": own} for place, own in names.items()}


def test_the_arm_travels_inside_the_log(tmp_path: Path) -> None:
    source, names = table_of_seven(tmp_path)
    content = {"robot": "xmate7p.yaml", "time": {"rate_hz": 50}} | names
    recording = imported(source, content)
    assert recording.joint_names == tuple(f"joint{k}" for k in range(1, 8))
    assert yaml.safe_load(recording.attachments["config.yaml"])["arm"] == "xmate7p"
    assert b'<robot name="xmate7p">' in recording.attachments["robot.urdf"]
    (tmp_path / "log.mcap").unlink()
    assert refused(
        source, content | {"position": {"columns": ["position1"]}}, ConfigurationError
    ) == (f"{tmp_path / 'map.yaml'}: position.columns: 1 entries for 7 joints.")
    other = [f"j{k}" for k in range(1, 8)]
    assert refused(source, content | {"joints": other}, ConfigurationError) == (
        f"{tmp_path / 'map.yaml'}: joints: j1, j2, j3, j4, j5, j6, j7 are not those of"
        " xmate7p.yaml, which are joint1, joint2, joint3, joint4, joint5, joint6, joint7."
    )


def test_a_plain_urdf_is_an_arm_too(tmp_path: Path) -> None:
    source, names = table_of_seven(tmp_path)
    (tmp_path / "mine.urdf").write_text(find_file("xmate7p.urdf").read_text())
    content = {"robot": "mine.urdf", "time": {"rate_hz": 50}} | names
    recording = imported(source, content)
    assert recording.joint_names == tuple(f"joint{k}" for k in range(1, 8))
    assert recording.attachments.keys() == {"robot.urdf", "mapping.yaml"}


def test_a_table_without_a_header_is_told(tmp_path: Path) -> None:
    source = tmp_path / "data.csv"
    np.savetxt(source, np.column_stack([T, T, T]), delimiter=",", fmt="%.6f")
    content = {"joints": ["a"], "time": {"column": 0}, "position": {"columns": [1]}}
    assert refused(source, content | {"effort": {"columns": [2]}}, ConfigurationError) == (
        f"{tmp_path / 'map.yaml'}: time.column: data.csv has no column 0, and its first line holds"
        " numbers: if it is no header, write `header: false` and count the columns from 1 to 3."
    )


def test_a_first_row_of_numbers_is_not_lost_as_a_header(tmp_path: Path) -> None:
    source, rows = tmp_path / "data.csv", np.column_stack([T, T, T])
    content = {"joints": ["a"], "time": {"column": 1}, "position": {"columns": [2]}}
    content |= {"effort": {"columns": [3]}}
    np.savetxt(source, rows, delimiter=",", fmt="%.6f")
    assert "the first line holds numbers" in refused(source, content, DataError)
    np.savetxt(source, rows, delimiter=",", fmt="%.6f", header="0,1,2", comments="")
    assert len(imported(source, content).q) == len(T)
    np.savetxt(source, rows, delimiter=",", fmt="%.6f")
    assert len(imported(source, content | {"header": False}).q) == len(T)


def test_a_text_of_another_kind_is_no_mapping(tmp_path: Path) -> None:
    (tmp_path / "mine.urdf").write_text('<robot name="mine">\n  <link name="base"/>\n</robot>\n')
    with pytest.raises(ConfigurationError) as caught:
        import_recording(basic_table(tmp_path), tmp_path / "mine.urdf", tmp_path / "log.mcap")
    assert str(caught.value) == (
        f"{tmp_path / 'mine.urdf'}: is XML, such as a URDF, and no YAML file."
    )


def test_the_command(tmp_path: Path) -> None:
    app = typer.Typer()
    app.command()(import_table)
    source, out = basic_table(tmp_path), tmp_path / "log.mcap"
    arguments = [str(source), "--map", str(mapping(tmp_path, BASIC)), "--out", str(out)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0
    assert result.stdout == (f"{out}: 50 samples of 2 joints over 0.196 s\n")
    assert result.stderr.endswith(f"Next: ident run {out} --robot ARM.urdf\n")
    result = CliRunner().invoke(app, [*arguments, "--json"])
    assert json.loads(result.stdout) == {
        "log": str(out),
        "samples": 50,
        "seconds": 0.196,
        "joints": ["a", "b"],
    }
