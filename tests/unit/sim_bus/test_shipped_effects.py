"""Hidden effects by name: what is shipped, and what its one line promises."""

import json

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from sim_bus.assembly import load_simulation
from sim_bus.cli import app
from sim_bus.errors import UnknownEffectError
from sim_bus.hidden_effects.catalogue import hidden_file, shipped_summaries

NAMES = list(shipped_summaries())


def test_several_are_shipped_one_of_which_the_gap_finder_does_not_know():
    assert len(NAMES) >= 8
    assert {"stribeck", "backlash", "hose"} <= set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_effect_changes_the_arm_of_the_shipped_configuration(name):
    plain, other = (load_simulation("wam7.yaml", 0, f).arm.plant for f in (None, hidden_file(name)))
    motor_torque, none = [0.5, -0.5, 0.4, 0.5, 0.1, 0.1, 0.01], [0.0] * 7
    for plant in (plain, other):
        plant.release()
        plant.advance(200_000_000, np.array(motor_torque), np.array(none))
    assert abs(plain.seen_at(200_000_000) - other.seen_at(200_000_000)).max() > 1e-6


@pytest.mark.parametrize("name", NAMES)
def test_its_line_names_its_joints_and_sizes(name):
    content = yaml.safe_load(hidden_file(name).read_text())
    (effect,) = content["effects"]
    line = content["summary"]
    assert line == shipped_summaries()[name]
    for joint in effect.get("joints", [])[:: max(1, len(effect.get("joints", [])) - 1)]:
        assert str(joint) in line
    sizes = [v for k, v in effect.items() if k not in ("effect", "joints", "form", "at_m")]
    assert sizes
    for size in sizes:
        assert f"{size:g}" in line or f"{100 * size:g} %" in line


def test_a_file_is_taken_as_it_is(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text("effects: []")
    assert hidden_file(str(file)) == file


def test_an_unknown_name_is_told_with_what_is_shipped():
    with pytest.raises(UnknownEffectError) as error:
        hidden_file("stribek")
    assert error.value.exit_code == 2
    assert str(error.value) == (
        "--hidden got 'stribek', which is neither a file nor the name of a shipped effect. Did you "
        f"mean stribeck? Shipped: {', '.join(NAMES)}."
    )


def test_the_program_lists_them():
    lines = CliRunner().invoke(app, ["hidden"]).output.splitlines()
    assert [line.split()[0] for line in lines] == NAMES
    assert json.loads(CliRunner().invoke(app, ["hidden", "--json"]).output) == shipped_summaries()
