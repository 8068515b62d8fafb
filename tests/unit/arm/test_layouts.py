"""The shipped plotting layouts name what a log holds, and are those that the script makes."""

import json
import re
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

import pytest

from wamctl.arm.config import find_file, load_robot_file

JOINTS = load_robot_file("wam7.yaml").robot.joints
FOXGLOVE = find_file("wam7.foxglove.json").read_text()
PLOTJUGGLER = find_file("wam7.plotjuggler.xml").read_text()


@pytest.fixture
def script() -> ModuleType:
    path = Path(__file__).parents[3] / "scripts" / "layouts"
    spec = spec_from_loader("layouts", SourceFileLoader("layouts", str(path)))
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_script_makes_them(script: ModuleType) -> None:
    assert script.foxglove(JOINTS) == FOXGLOVE
    assert script.plotjuggler(JOINTS) == PLOTJUGGLER


def test_every_foxglove_panel_is_placed_and_names_a_field_of_the_log() -> None:
    layout = json.loads(FOXGLOVE)
    panels = layout["configById"]
    values = [
        path["value"]
        for name, p in panels.items()
        if name.startswith("Plot!")
        for path in p["paths"]
    ]
    assert len(values) == len(set(values)) == 7 * 3 * 2
    pattern = r"/joint_(states|commands)\.(position|velocity|effort)\[[0-6]\]"
    assert all(re.fullmatch(pattern, value) for value in values)
    placed = re.findall(r'"(\w+!\w+)"(?!:)', json.dumps(layout))
    assert sorted(placed) == sorted(panels)


def snake_case(content: dict) -> dict:
    return {re.sub("[A-Z]", lambda c: f"_{c[0].lower()}", k): v for k, v in content.items()}


def test_foxglove_s_own_types_take_every_panel_and_give_it_back() -> None:
    types = pytest.importorskip("foxglove.layouts", reason="foxglove-sdk is not installed")
    for name, panel in json.loads(FOXGLOVE)["configById"].items():
        content = {k: v for k, v in panel.items() if k != "title"}
        kind = name.split("!")[0]
        if kind == "Plot":
            series = [types.PlotSeries(**snake_case(path)) for path in content["paths"]]
            made = types.PlotConfig(**snake_case(content | {"paths": series}))
        elif kind == "DiagnosticSummary":
            made = types.DiagnosticsSummaryConfig(**snake_case(content))
        else:
            assert kind == "Tab"
            continue
        assert json.loads(made.to_json()) == content


def test_every_plotjuggler_curve_is_a_field_of_the_log() -> None:
    curves = [c.attrib["name"] for c in ElementTree.fromstring(PLOTJUGGLER).iter("curve")]
    quantities = ("position", "velocity", "effort")
    topics = ("/joint_states", "/joint_commands")
    known = {f"{t}/{j}/{x}" for t in topics for j in JOINTS for x in quantities}
    known |= {f"/joint_reference/{x}[{k}]" for x in ("positions", "velocities") for k in range(7)}
    assert set(curves) == known
