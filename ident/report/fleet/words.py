"""Changes of arms in words."""

from collections.abc import Sequence

from ident.effects.catalogue import catalogue
from ident.report.words import Content, effect_text, plus_minus, share
from wamctl.arm.joint_labels import joints_text, listed


def change_text(change: Content, joints: Sequence[str]) -> str:
    """What changed, where, and by how much.

    Args:
        change: of `changes.json`.
        joints: labels of all joints.
    """
    size = plus_minus(change["size"], change["sd"], change["unit"])
    sign = "+" if change["size"] > 0 else ""
    which = f"{change['parameter']} " if change["name"] == "parameter" else ""
    return f"{what_text(change, joints)}: {which}{sign}{size}"


def what_text(change: Content, joints: Sequence[str]) -> str:
    """What changed, and where.

    Args:
        change: with `name` and `joints`.
        joints: labels of all joints.
    """
    labels: list[str] = [str(joints[j - 1]) for j in change["joints"]]
    where = "" if change["name"] == "payload" else f" at {joints_text(labels)}"
    friction = change["name"] == "parameter"
    return f"{'friction' if friction else catalogue()[change['name']].title}{where}"


def rivals_text(change: Content) -> str:
    """What explains a change nearly as well; nothing where nothing does."""
    named = [
        f"{effect_text(r['name'], r['joints'])} ({share(r['share'], 2)})" for r in change["rivals"]
    ]
    return f" It may also be {listed(named)}." if named else ""


def day(moment: str) -> str:
    """The day of a moment."""
    return moment.partition("T")[0]
