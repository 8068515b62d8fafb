"""What arms of one type share: the meaning of their columns."""

import json
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ident.estimation.problem import prior_parameters
from ident.fleet.columns import Columns, Name
from ident.signals.arrays import Array

_AXES = ("xx", "xy", "xz", "yy", "yz", "zz")

TOOL = ("mass", *(f"first_moment_{a}" for a in "xyz"), *(f"inertia_{a}" for a in _AXES))
"""A rigid load's ten parameters, in the order of `ArmType.payload`."""

_PLACES = (9, 6, 7, 8, 0, 1, 2, 3, 4, 5)  # among a link's


_WARM = (("fc", "stribeck"), ("fv",), ("fcm",), ("fvm",))


@dataclass(frozen=True)
class ArmType:
    """The p columns of a type.

    Attributes:
        arm: name of the arm's model.
        names: of the columns.
        joints: the joints' names, n of them.
        cad: values of the columns by CAD, zero where CAD says nothing, shape (p,).
        payload: columns per unit of each of `TOOL`, shape (p, 10).
    """

    arm: str
    names: tuple[Name, ...]
    joints: tuple[str, ...]
    cad: Array
    payload: Array

    @cached_property
    def places(self) -> dict[tuple[str, int], list[int]]:
        """Columns of each kind and joint."""
        found: dict[tuple[str, int], list[int]] = {}
        for place, name in enumerate(self.names):
            found.setdefault((name.kind, name.joint), []).append(place)
        return found

    def of_kinds(self, *kinds: str) -> list[int]:
        """Places of the columns of some kinds."""
        return [place for place, name in enumerate(self.names) if name.kind in kinds]

    @cached_property
    def warm(self) -> list[list[int]]:
        """Places of the columns that follow the temperature alike: friction, joint by joint.

        Dry friction at all speeds goes together, and viscous friction.
        """
        found = []
        for joint in range(1, len(self.joints) + 1):
            for kinds in _WARM:
                places = [k for kind in kinds for k in self.places.get((kind, joint), [])]
                found += [places] if places else []
        return found

    def text(self) -> str:
        """As JSON; `read` is the way back."""
        return json.dumps(
            {
                "arm": self.arm,
                "joints": self.joints,
                "columns": [
                    {"name": n.text, "unit": n.unit, "kind": n.kind, "joint": n.joint}
                    for n in self.names
                ],
                "cad": self.cad.tolist(),
                "payload": self.payload.tolist(),
            }
        )

    @classmethod
    def read(cls, text: str) -> "ArmType":
        """The type that `text` wrote."""
        content = json.loads(text)
        names = tuple(Name(c["name"], c["unit"], c["kind"], c["joint"]) for c in content["columns"])
        cad, payload = np.array(content["cad"]), np.array(content["payload"])
        return cls(content["arm"], names, tuple(content["joints"]), cad, payload)


def arm_type(columns: Columns) -> ArmType:
    """The type of an arm."""
    base, robot = columns.base, columns.arm.robot
    cad, payload = np.zeros(columns.count), np.zeros((columns.count, len(TOOL)))
    b = len(base.kept)
    cad[:b] = base.K @ prior_parameters(robot, base)
    inertial = [i for i, p in enumerate(base.parameters) if p.kind == "inertial"]
    last = inertial[-10:]
    payload[:b] = base.K[:, [last[k] for k in _PLACES]]
    return ArmType(columns.arm.name, columns.names, robot.joint_names, cad, payload)
