"""`ident fleet` on a small fleet: what it says, and that it says it whoever does the work."""

import json
import shutil
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import duckdb
import numpy as np
import pandas as pd
import pytest

from ident.cli import main
from ident.fleet.engine import LostError, Workers, done, engine
from ident.fleet.metadata import Rules, rules
from ident.fleet.settings import FleetSettings
from ident.fleet.sources import found_logs
from ident.recordings.loading import Reading
from ident.workflows.fleet import changed_gap
from ident.workflows.fleet import fleet as work
from tests.unit.fleet import killed
from tests.unit.fleet.conftest import START_NS, Arm, ordinary, write_log
from wamctl.arm.errors import DataError

FILES = ("logs.parquet", "parameters.parquet", "changes.json", "fleet.json")


@contextmanager
def here():
    """An executor without processes of its own."""
    with ThreadPoolExecutor(1) as pool:
        yield pool


@pytest.fixture
def without_processes(monkeypatch):
    monkeypatch.setattr(work, "engine", lambda scheduler, workers: (here, 4))


WITHOUT_GAPS = FleetSettings(gap_arms=0)


def run(logs, out, settings=WITHOUT_GAPS, **options):
    said = options.pop("rules", Rules())
    return json.loads(
        work.fleet_logs([str(logs)], out, None, Reading(), said, settings=settings, **options)
    )


@pytest.fixture(scope="session")
def found(logs, tmp_path_factory):
    out = tmp_path_factory.mktemp("found")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(work, "engine", lambda scheduler, workers: (here, 4))
        return run(logs, out), out


def test_changes_are_found_and_named_and_nothing_else(found):
    content, out = found
    changes = json.loads((out / "changes.json").read_text())
    assert changes == content["changes"]
    by_arm = {c["arm"]: c for c in changes}
    assert set(by_arm) == {"arm2", "arm4"}
    assert len(changes) == 2
    friction, payload = by_arm["arm2"], by_arm["arm4"]
    assert friction["name"] == "parameter"
    assert friction["parameter"] == "fc2"
    planted = 0.3 * ordinary(np.random.default_rng(2)).fc[1]
    assert abs(friction["size"] - planted) < 4 * friction["sd"]
    assert friction["unit"] == "N m"
    assert payload["name"] == "payload"
    assert abs(payload["size"] - 0.3) < max(4 * payload["sd"], 0.03)
    assert {c["since"] for c in changes} == {"2026-01-06T08:00:00Z"}


def test_friction_follows_the_temperature_that_it_was_made_with(found):
    content, _ = found
    (kind,) = content["types"].values()
    (fc,) = [p for p in kind["parameters"] if p["name"] == "fc1"]
    assert fc["per_kelvin"] == pytest.approx(-0.005, abs=4 * fc["per_kelvin_sd"])


def test_it_says_how_small_a_change_its_logs_would_tell(found):
    (kind,) = found[0]["types"].values()
    shown = {(s["name"], *s["joints"]): s for s in kind["shown"]}
    assert {("payload", 2), ("stribeck", 1), ("encoder_offset", 2)} < set(shown)
    assert 0.0 < shown["payload", 2]["size"] < 0.3  # a load that was told
    assert shown["payload", 2]["unit"] == "kg"
    assert "How small a change would be told" in (found[1] / "fleet.html").read_text()


def test_tables_open_in_duckdb_and_pandas(found):
    _, out = found
    logs = duckdb.sql(f"select arm, count(*) n from '{out}/logs.parquet' group by arm").fetchall()
    assert sorted(logs) == [(f"arm{k}", 10) for k in range(6)]
    frame = pd.read_parquet(out / "parameters.parquet")
    assert {"arm", "time", "log", "parameter", "value", "sd", "unit"} <= set(frame.columns)
    fc = frame[(frame.parameter == "fc2") & (frame.arm == "arm2")].sort_values("time")
    before, after = fc.level.iloc[4], fc.level.iloc[9]
    assert after - before == pytest.approx(0.15, abs=0.03)


def test_pages_tell_the_changes_and_link_each_arm(found):
    _, out = found
    page = (out / "fleet.html").read_text()
    assert "2 of 6 arms have changed" in page
    assert 'href="arms/arm2.html"' in page
    arm = (out / "arms" / "arm2.html").read_text()
    assert "fc2" in arm
    assert "firmware 1 became 2" in arm


@pytest.mark.thorough
def test_a_changed_arm_is_searched_for_the_effect_beside_the_model_from_before(
    logs, found, tmp_path, monkeypatch, without_processes
):
    again = tmp_path / "again"
    shutil.copytree(found[1], again)
    search = changed_gap.gap_logs

    def one_is_refused(paths, *rest):
        if "arm2" in str(paths[0]):
            raise DataError("This log says nothing.")
        return search(paths, *rest)

    monkeypatch.setattr(changed_gap, "gap_logs", one_is_refused)
    settings = FleetSettings(gap_logs=2)
    content = run(logs, again, settings)
    asked = {c["arm"]: c["gap"] for c in content["changes"]}
    assert set(asked) == {"arm2", "arm4"}
    assert asked["arm2"]["sentences"] == ["This log says nothing."]
    assert "This log says nothing." in (again / "arms" / "arm2.html").read_text()
    load = asked["arm4"]
    assert load["verdict"] == "named"
    assert [e["name"] for e in load["effects"]] == ["payload"]
    assert load["logs"] == [2, 2]
    assert (again / load["report"]).is_file()
    assert f'href="../{load["report"]}"' in (again / "arms" / "arm4.html").read_text()
    # the same logs are not searched again
    monkeypatch.setattr(changed_gap, "gap_logs", None)
    assert run(logs, again, settings) == content


def test_nothing_is_read_twice_and_the_result_stays_the_same(
    logs, found, tmp_path, monkeypatch, without_processes
):
    _, out = found
    again = tmp_path / "again"
    shutil.copytree(out, again)
    monkeypatch.setattr("ident.fleet.reducing.work", None)
    run(logs, again)
    for name in FILES:
        assert (again / name).read_bytes() == (out / name).read_bytes()


def test_broken_logs_are_listed_with_their_sentence(logs, tmp_path, without_processes):
    mine = tmp_path / "logs" / "arm0"
    mine.mkdir(parents=True)
    whole = [logs / "arm0" / f"day{k}.mcap" for k in range(4)]
    for log in whole:
        shutil.copy(log, mine)
    (mine / "cut.mcap").write_bytes(whole[0].read_bytes()[:300])
    (mine / "noise.mcap").write_bytes(b"no log at all" * 50)
    shutil.copy(whole[1], mine / "copy.mcap")
    content = json.loads(
        work.fleet_logs(
            [str(mine), str(mine / "gone.mcap")], tmp_path / "out", None, Reading(), Rules()
        )
    )
    refused = {Path(r["log"]).name: r["remarks"] for r in content["refused"]}
    assert set(refused) == {"cut.mcap", "noise.mcap", "gone.mcap", "day1.mcap"}
    assert all(len(remarks) >= 1 and remarks[0].endswith(".") for remarks in refused.values())
    assert "is not there" in refused["gone.mcap"][0]
    assert "has the same bytes as" in refused["day1.mcap"][0]
    assert content["logs"] == {"found": 8, "used": 4, "refused": 4}


def test_pattern_and_table_say_whose_a_log_is(tmp_path, without_processes):
    rng = np.random.default_rng(1)
    arm = Arm(np.array([1.0, 0.5]), np.array([0.4, 0.2]))
    write_log(tmp_path / "site" / "r7_20260304_31.5.mcap", arm, 0, rng)
    said = rules("{arm}_{time}_{temperature}.mcap", None)
    run(tmp_path / "site", tmp_path / "a", rules=said)
    row = pd.read_parquet(tmp_path / "a" / "logs.parquet").iloc[0]
    assert (row.arm, row.temperature) == ("r7", 31.5)
    assert row.time == pd.Timestamp("2026-03-04T00:00:00Z")
    table = tmp_path / "table.csv"
    table.write_text("log,arm,tool\nsite/r7_20260304_31.5.mcap,left,gripper\n")
    run(tmp_path / "site", tmp_path / "b", rules=rules(None, table))
    row = pd.read_parquet(tmp_path / "b" / "logs.parquet").iloc[0]
    assert (row.arm, row.tool, row.time) == ("left", "gripper", pd.Timestamp(START_NS, tz="UTC"))


@pytest.mark.thorough
def test_processes_and_dask_give_the_same_bytes(logs, tmp_path, monkeypatch):
    some = [f"{logs}/arm{k}/day[0-3].mcap" for k in (1, 2)]

    def files(*words) -> list[bytes]:
        """The results of a scheduler with so many workers."""
        out = tmp_path / "-".join(map(str, words))
        work.fleet_logs(some, out, None, Reading(), Rules(), Workers(*words), settings=WITHOUT_GAPS)
        return [(out / name).read_bytes() for name in FILES]

    processes, dask = files(None, 2), files("local", 1)
    monkeypatch.setattr(work, "engine", lambda scheduler, workers: (here, 4))
    assert files() == processes == dask


@pytest.fixture
def at_once(monkeypatch):
    monkeypatch.setattr("ident.fleet.engine._AGAIN_S", 0.0)


def test_the_work_of_a_killed_worker_is_given_out_again(tmp_path, at_once):
    make, waiting = engine(None, 1)
    items = [str(tmp_path / str(k)) for k in range(3)]
    found = dict(done(make, killed.once, items, waiting))
    assert found == {item: Path(item).name for item in items}


def test_what_kills_its_worker_each_time_is_given_up(at_once):
    make, waiting = engine(None, 1)
    ((item, found),) = done(make, killed.always, ["one"], waiting)
    assert item == "one"
    assert isinstance(found, LostError)


def test_no_log_and_unknown_fields_are_told_in_a_sentence(tmp_path, capsys):
    assert call("fleet", tmp_path) == 6
    assert "holds no log" in capsys.readouterr().err
    assert call("fleet", tmp_path, "--pattern", "{robot}.mcap") == 3
    assert "unknown field 'robot'" in capsys.readouterr().err


def call(*arguments: object) -> int:
    """Exit status of an `ident` command."""
    with pytest.raises(SystemExit) as ended:
        main([str(a) for a in arguments])
    return int(ended.value.code or 0)


def test_every_kind_of_log_is_found_in_a_folder(tmp_path):
    for name in ("a.mcap", "sub/b.db3", "c.bag", "notes.txt", "bag/metadata.yaml", "bag/d.db3"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    found = [str(Path(s.address).relative_to(tmp_path)) for s in found_logs([str(tmp_path)])]
    assert found == ["a.mcap", "bag", "c.bag", "sub/b.db3"]
