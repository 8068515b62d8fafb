"""Faults planted in URDFs are found where they are, and the repaired files have none."""

import json
import re
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
import pytest
from published_robots import arms, published

from ident.cli import main
from ident.urdf_check.examine import examine_urdf
from ident.urdf_check.finding import Finding, Grade
from ident.urdf_check.inertials import density, nearest_possible, spreads
from wamctl.arm.errors import ConfigurationError
from wamctl.arm.robot import load_robot

Plant = Callable[[Element], str]
"""Plants a fault, and gives the name of the link or joint."""


def link(root: Element) -> Element:
    """A link in the middle of the arm whose mass is not small."""
    found = [x for x in root.iterfind("link") if x.find("inertial") is not None]
    heavy = [x for x in found if float(x.find("inertial/mass").get("value")) > 0.05]
    return heavy[len(heavy) // 2]


def joint(root: Element) -> Element:
    """A revolute joint in the middle of the arm."""
    found = [x for x in root.iterfind("joint[@type='revolute']") if x.find("mimic") is None]
    return found[len(found) // 2]


def of_link(path: str, **values: str) -> Plant:
    def plant(root: Element) -> str:
        chosen = link(root)
        above, _, tag = path.rpartition("/")
        element = chosen.find(path)
        element = ElementTree.SubElement(chosen.find(above), tag) if element is None else element
        element.attrib.update(values)
        return chosen.get("name")

    return plant


def scaled(path: str, factor: float) -> Plant:
    def plant(root: Element) -> str:
        chosen = link(root)
        attributes = chosen.find(path).attrib
        attributes.update({key: repr(float(text) * factor) for key, text in attributes.items()})
        return chosen.get("name")

    return plant


def without(path: str, attribute: str) -> Plant:
    def plant(root: Element) -> str:
        chosen = link(root)
        del chosen.find(path).attrib[attribute]
        return chosen.get("name")

    return plant


def of_joint(tag: str, **values: str) -> Plant:
    def plant(root: Element) -> str:
        chosen = joint(root)
        element = chosen.find(tag)
        element = ElementTree.SubElement(chosen, tag) if element is None else element
        element.attrib.update(values)
        return chosen.get("name")

    return plant


def no_limit(root: Element) -> str:
    chosen = joint(root)
    chosen.remove(chosen.find("limit"))
    return chosen.get("name")


def mass_with_comma(root: Element) -> str:
    mass = link(root).find("inertial/mass")
    mass.set("value", f"{float(mass.get('value')):.4f}".replace(".", ","))
    return link_of(root, mass)


def link_of(root: Element, mass: Element) -> str:
    return next(x.get("name") for x in root.iterfind("link") if x.find("inertial/mass") is mass)


def no_name(root: Element) -> str:
    del root.attrib["name"]
    return ""


def same_name(root: Element) -> str:
    first, second = list(root.iterfind("link"))[:2]
    second.set("name", first.get("name"))
    return first.get("name")


def reversed_limits(root: Element) -> str:
    limit = joint(root).find("limit")
    limit.set("lower", "1.2")
    limit.set("upper", "-1.1")
    return joint(root).get("name")


INERTIA = "inertial/inertia"
PLANTED: dict[str, tuple[str, Plant]] = {
    "moments against the triangle inequality": (
        "triangle",
        of_link(INERTIA, ixx="0.1", iyy="0.02", izz="0.03", ixy="0", ixz="0", iyz="0"),
    ),
    "a negative moment": ("negative_inertia", of_link(INERTIA, ixx="-0.1")),
    "large products": ("negative_inertia", of_link(INERTIA, ixx="0.1", iyy="0.1", ixy="0.3")),
    "a negative mass": ("number", of_link("inertial/mass", value="-1")),
    "no mass": ("inertia_without_mass", of_link("inertial/mass", value="0")),
    "a mass that is no number": ("number", of_link("inertial/mass", value="nan")),
    "a decimal comma": ("number", mass_with_comma),
    "a moment that is missing": ("number", without(INERTIA, "iyy")),
    "a product that is missing": ("number", without(INERTIA, "ixz")),
    "a mass in grams": ("density", scaled("inertial/mass", 1e3)),
    "inertia in kg mm^2": ("density", scaled(INERTIA, 1e6)),
    "a centre of mass in millimetres": ("centre_far", of_link("inertial/origin", xyz="0 0 150")),
    "no limits": ("limit_missing", no_limit),
    "reversed limits": ("limit_reversed", reversed_limits),
    "limits that leave no motion": ("limit_empty", of_joint("limit", lower="0", upper="0")),
    "limits in degrees": ("limit_degrees", of_joint("limit", lower="-170", upper="170")),
    "a negative speed limit": ("velocity_negative", of_joint("limit", velocity="-2")),
    "an axis without direction": ("number", of_joint("axis", xyz="0 0 0")),
    "an axis of two numbers": ("number", of_joint("axis", xyz="0 1")),
    "a frame turned in degrees": ("origin_degrees", of_joint("origin", rpy="90 0 0")),
    "negative damping": ("damping_negative", of_joint("dynamics", damping="-0.5")),
    "a parent that does not exist": ("tree", of_joint("parent", link="nowhere")),
    "a robot without a name": ("name", no_name),
    "two links of one name": ("name", same_name),
    "a mimic of no joint": ("mimic", of_joint("mimic", joint="nothing")),
}


def grave(findings: tuple[Finding, ...]) -> set[tuple[str, str]]:
    return {(f.code, f.name) for f in findings if f.grade is not Grade.NOTE}


@pytest.mark.parametrize("file", dict.fromkeys(arms()), ids=lambda p: p.stem)
def test_every_planted_fault_is_found(file: Path) -> None:
    text = file.read_text("utf-8")
    before = grave(examine_urdf(text, file).findings)
    for code, plant in PLANTED.values():
        root = ElementTree.fromstring(text)
        name = plant(root)
        found = examine_urdf(ElementTree.tostring(root, encoding="unicode"), file)
        assert (code, name) in grave(found.findings) - before
        repairable = {(f.code, f.name) for f in found.findings if f.repair is not None}
        assert not repairable & grave(found.left)


def test_a_base_that_joints_name_and_no_link_is_added() -> None:
    """As in files whose first joint fixes the arm to a `world` that nobody wrote down."""
    root = ElementTree.fromstring(arms()[0].read_text("utf-8"))
    base = next(iter(root.iterfind("link"))).get("name")
    world = ElementTree.SubElement(root, "joint", name="to_world", type="fixed")
    ElementTree.SubElement(world, "parent", link="world")
    ElementTree.SubElement(world, "child", link=base)
    found = examine_urdf(ElementTree.tostring(root, encoding="unicode"), "arm.urdf")
    assert [f.name for f in found.faults] == ["to_world"]
    assert not found.faults_left
    load_robot(found.repaired)


@pytest.mark.parametrize("kind", [k for k, (code, _) in PLANTED.items() if code != "tree"])
def test_a_repaired_arm_can_be_loaded(kind: str) -> None:
    _, plant = PLANTED[kind]
    root = ElementTree.fromstring(arms()[0].read_text("utf-8"))
    plant(root)
    found = examine_urdf(ElementTree.tostring(root, encoding="unicode"), "arm.urdf")
    if not found.faults_left:
        load_robot(found.repaired)


@pytest.mark.parametrize("file", published(), ids=lambda p: p.stem)
def test_published_robots(file: Path) -> None:
    found = examine_urdf(file.read_text("utf-8"), file)
    again = examine_urdf(found.repaired, file)
    assert grave(again.findings) == grave(found.left)
    codes = {f.code for f in found.faults}
    known_wrong = {
        "name",
        "triangle",
        "negative_inertia",
        "inertia_without_mass",
        "limit_empty",
        "mimic",
    }
    assert codes <= known_wrong
    for finding in found.faults:
        if finding.code in ("triangle", "negative_inertia"):
            assert is_impossible(file, finding.name)


def is_impossible(file: Path, name: str) -> bool:
    """By Sylvester's criterion on tr(I) / 2 E - I, another way than the one that is tested."""
    inertia = ElementTree.fromstring(file.read_text("utf-8")).find(
        f"link[@name='{name}']/inertial/inertia"
    )
    xx, xy, xz, yy, yz, zz = (
        float(inertia.get(f"i{k}")) for k in ("xx", "xy", "xz", "yy", "yz", "zz")
    )
    a, b, c = (yy + zz - xx) / 2, (xx + zz - yy) / 2, (xx + yy - zz) / 2
    minors = (a, b, c, a * b - xy**2, a * c - xz**2, b * c - yz**2)
    whole = a * (b * c - yz**2) - xy * (xy * c + yz * xz) - xz * (xy * yz + b * xz)
    size = max(xx, yy, zz)
    return min((*minors[:3], *(m / size for m in minors[3:]), whole / size**2)) < 1e-9 * size


def test_the_nearest_possible_tensor_is_nearest() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        tensor = rng.normal(size=(3, 3))
        tensor = tensor + tensor.T
        nearest = nearest_possible(tensor)
        assert spreads(nearest)[0] > 0
        distance = np.linalg.norm(nearest - tensor)
        axes = np.linalg.qr(rng.normal(size=(200, 3, 3)))[0]
        others = np.einsum("sij,sj,skj->sik", axes, rng.exponential(size=(200, 3)), axes)
        possible = np.trace(others, axis1=1, axis2=2)[:, None, None] * np.eye(3) - others
        for other in possible:
            steps = [nearest + s * (other - nearest) for s in (1.0, 0.1, 1e-3)]
            assert min(np.linalg.norm(step - tensor) for step in steps) > distance - 1e-5
    np.testing.assert_allclose(nearest_possible(np.diag([1.0, 2.0, 2.5])), np.diag([1, 2, 2.5]))


def test_the_density_of_a_steel_ball() -> None:
    radius, mass = 0.1, 7850 * 4 / 3 * np.pi * 0.1**3
    assert density(mass, 0.4 * mass * radius**2 * np.eye(3)) == pytest.approx(7850)


@pytest.mark.parametrize("text", ["", "no xml", "<sdf/>", "<robot"])
def test_what_is_no_urdf(text: str) -> None:
    with pytest.raises(ConfigurationError, match=r"not readable as XML|no URDF"):
        examine_urdf(text, "arm.urdf")


def test_what_is_made_into_a_urdf() -> None:
    text = '<robot><link name="a"><inertial><mass value="${m}"/></inertial></link></robot>'
    with pytest.raises(ConfigurationError, match="xacro, not URDF"):
        examine_urdf(text, "arm.urdf.xacro")


def call(*arguments: object) -> int:
    with pytest.raises(SystemExit) as ended:
        main([str(a) for a in arguments])
    return int(ended.value.code or 0)


def test_the_command_repairs(tmp_path, capsys) -> None:
    text = arms()[-1].read_text("utf-8")
    wrong = tmp_path / "arm.urdf"
    wrong.write_text(re.sub(r'ixx="[^"]*"', 'ixx="-0.1"', text, count=1))
    out = tmp_path / "repaired.urdf"
    assert call("check-urdf", wrong) == 3
    assert "1 fault, of which 1 can be repaired" in capsys.readouterr().out
    assert call("check-urdf", wrong, "--out", out, "--json") == 0
    assert json.loads(capsys.readouterr().out)["verdict"] == "repaired"
    assert call("check-urdf", out) == 0


def test_the_command_says_what_is_no_urdf(tmp_path, capsys) -> None:
    assert call("check-urdf", tmp_path / "none.urdf") == 3
    assert call("check-urdf", __file__) == 3
    assert capsys.readouterr().err.count("\n") == 2


def test_two_turns_rounded_up_are_no_degrees() -> None:
    root = ElementTree.fromstring(arms()[0].read_text("utf-8"))
    of_joint("limit", lower="-12.6", upper="12.6")(root)
    found = examine_urdf(ElementTree.tostring(root, encoding="unicode"), "arm.urdf")
    assert not [f for f in found.findings if f.code.startswith("limit")]


def test_doubts_and_notes_are_counted_apart(tmp_path, capsys) -> None:
    bare = tmp_path / "bare.urdf"
    limit = '<limit lower="-170" upper="170" effort="1" velocity="1"/>'
    bare.write_text(
        '<robot name="a"><link name="b"/><link name="c"/><joint name="j" type="revolute">'
        f'<parent link="b"/><child link="c"/><axis xyz="0 0 1"/>{limit}</joint></robot>'
    )
    assert call("check-urdf", bare) == 0
    assert "no fault was found, but see the 1 doubt and 1 note above." in capsys.readouterr().out


def test_planted_in_twenty() -> None:
    assert len(PLANTED) >= 20
    assert len(arms()) == 20
    if published():
        assert all(a != b for a, b in pairwise(sorted(arms())))
