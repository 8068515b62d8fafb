"""All checks of a URDF, and its repaired text."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from xml.etree import ElementTree

from ident.urdf_check.finding import Finding, Grade, Repair
from ident.urdf_check.inertials import inertial_findings
from ident.urdf_check.joints import Ranges, joint_findings
from ident.urdf_check.structure import massless_findings, reach_m, structure_findings
from ident.urdf_check.xml_values import Element
from wamctl.arm.errors import ConfigurationError
from wamctl.arm.robot import refuse_xacro
from wamctl.arm.urdf.numbers import collision_faults, joint_faults, link_faults

_DECIMAL_COMMA = re.compile(r"(?<=\d),(?=\d)")
_PRODUCTS = ("ixy", "ixz", "iyz")


@dataclass(frozen=True)
class Examination:
    """What was found in a URDF.

    Attributes:
        findings: of the file as it is, faults first.
        left: what is still wrong after the repair.
        repaired: the file's text with every repair.
    """

    findings: tuple[Finding, ...]
    left: tuple[Finding, ...]
    repaired: str

    @property
    def faults(self) -> tuple[Finding, ...]:
        """Findings that are faults."""
        return _faults(self.findings)

    @property
    def faults_left(self) -> tuple[Finding, ...]:
        """Faults that the repaired text still has."""
        return _faults(self.left)


def examine_urdf(text: str, source: Path | str, moved: Ranges | None = None) -> Examination:
    """Check a URDF, and repair what can be repaired without a measurement.

    Args:
        text: of the file.
        source: what to call it in messages.
        moved: where a recording has the joints, if there is one; what it contradicts is not done.

    Raises:
        ConfigurationError: no XML, no robot, or xacro.
    """
    root = _parsed(text, source)
    findings = list(_numbers(root))
    _repair(findings)
    values = list(_values(root, moved))
    _repair(values)
    left = [*_numbers(root), *_values(root, moved)]
    ElementTree.indent(root)
    repaired = '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"
    return Examination(_sorted([*findings, *values]), _sorted(left), repaired)


def _parsed(text: str, source: Path | str) -> Element:
    refuse_xacro(text, source)
    builder = ElementTree.TreeBuilder(insert_comments=True)
    try:
        root = ElementTree.fromstring(text, ElementTree.XMLParser(target=builder))
    except (ElementTree.ParseError, ValueError) as error:
        raise ConfigurationError(source, [f"not readable as XML ({error})"]) from error
    if root.tag != "robot":
        raise ConfigurationError(
            source, [f"begins with <{root.tag}> and not with <robot>: no URDF"]
        )
    return root


def _values(root: Element, moved: Ranges | None) -> Iterator[Finding]:
    """Findings on numbers that are readable."""
    yield from structure_findings(root)
    reach = reach_m(root)
    for link in root.iterfind("link"):
        yield from inertial_findings(link, reach)
    names = frozenset(joint.get("name", "") for joint in root.iterfind("joint"))
    for joint in root.iterfind("joint"):
        yield from joint_findings(joint, names, moved)
    yield from massless_findings(root)


def _numbers(root: Element) -> Iterator[Finding]:
    """Numbers that cannot be read; decimal commas and missing products have a repair."""
    checks = {"link": (link_faults, collision_faults), "joint": (joint_faults,)}
    for kind, faults in checks.items():
        for element in root.iterfind(kind):
            for sentence in chain.from_iterable(check(element) for check in faults):
                repair, words = _number_repair(element, sentence)
                name = element.get("name", "")
                yield Finding(Grade.FAULT, "number", kind, name, sentence, repair, words)


def _number_repair(element: Element, sentence: str) -> tuple[Repair | None, str]:
    """What mends the number that a sentence is about, and what is written then."""
    if _DECIMAL_COMMA.search(sentence):
        commas = [
            (part, key)
            for part in element.iter()
            for key, value in part.attrib.items()
            if key != "name" and _DECIMAL_COMMA.search(value)
        ]
        return partial(_without_commas, commas), "decimal points"
    tensor, what = element.find("inertial/inertia"), sentence.split()[0]
    if tensor is not None and what in _PRODUCTS and tensor.get(what) is None:
        return partial(tensor.set, what, "0"), f"{what} 0"
    return None, ""


def _without_commas(places: list[tuple[Element, str]]) -> None:
    for part, key in places:
        part.set(key, _DECIMAL_COMMA.sub(".", part.attrib[key]))


def _repair(findings: list[Finding]) -> None:
    for finding in findings:
        if finding.repair is not None:
            finding.repair()


def _sorted(findings: list[Finding]) -> tuple[Finding, ...]:
    return tuple(sorted(findings, key=lambda f: list(Grade).index(f.grade)))


def _faults(findings: tuple[Finding, ...]) -> tuple[Finding, ...]:
    return tuple(f for f in findings if f.grade is Grade.FAULT)
