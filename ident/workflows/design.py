"""`ident design` from files to files."""

from pathlib import Path
from typing import Any, Literal

from ident.effects.bound_effects import load_model
from ident.effects.simulated_model import simulation_of
from ident.excitation.design import Design, DesignTask, design
from ident.excitation.optimisation.multistart import Report
from ident.excitation.problem.arm_limits import design_limits
from ident.excitation.settings import DesignSettings
from ident.excitation.target_effect import design_motion, purpose_of
from ident.model.arm import arm_from_file
from ident.report.design_page import DesignReport, design_page
from ident.report.motion_view import view_page
from ident.report.page import render
from ident.simulation.arm import SimulatedArm
from ident.workflows.work import provenance
from wamctl.arm.config import find_file, load_arm_file
from wamctl.arm.errors import ConfigurationError, write_text, writing
from wamctl.arm.trajectory import read_trajectory, write_trajectory

Constraints = Literal["all", "joint_motion"]


def place_of(
    config: Path, constraints: Constraints | None = None, model: Path | None = None
) -> DesignTask:
    """The arm of a configuration and the bounds of its excitation.

    Args:
        config: the arm's file.
        constraints: limits to keep; None: what the file says.
        model: the `model.yaml` of the arm as it was identified before, if it was.

    Raises:
        ConfigurationError: a file that cannot be used, an empty range, or another arm's model.
    """
    found = find_file(config)
    arm = load_arm_file(found)
    if constraints is not None:
        excitation = arm.excitation.model_copy(update={"constraints": constraints})
        arm = arm.model_copy(update={"excitation": excitation})
    robot = arm_from_file(found, ()).robot
    known = None if model is None else _known(model, robot.joint_names)
    return DesignTask(arm, robot, design_limits(arm, found), found, known)


def _known(path: Path, joints: tuple[str, ...]) -> SimulatedArm:
    model = load_model(path)
    if model.robot.joint_names != joints:
        raise ConfigurationError(
            "--model",
            [
                f"{path} has the joints {', '.join(model.robot.joint_names)}, and not"
                f" {', '.join(joints)}"
            ],
        )
    return simulation_of(model)


def design_file(
    config: Path,
    out: Path,
    settings: DesignSettings,
    start: Path | None,
    report: Report,
    model: Path | None = None,
) -> Design:
    """Design a trajectory and write it.

    Args:
        config: the arm's file.
        out: trajectory file to write.
        settings: what to minimise, how, and when to stop.
        start: a trajectory file to improve.
        report: called with every better design, and with None in between.
        model: the `model.yaml` of the arm as it was identified before, to try motions on.

    Raises:
        ConfigurationError: a file that cannot be used, or impossible limits.
        DataError: the trajectory cannot be written.
    """
    place = place_of(config, settings.constraints, model)
    first = None if start is None else read_trajectory(start).series
    found = design(place, settings, first, report)
    save(found, out)
    return found


def design_for(config: Path, out: Path, purpose: str) -> Design:
    """Take a motion from the library and write it.

    Args:
        config: the arm's file.
        out: trajectory file to write.
        purpose: `EFFECT`, `EFFECT:JOINT`, or a gap.json.

    Raises:
        ConfigurationError: a file that cannot be used, an unknown effect or joint.
        DataError: a gap file without a question, or the trajectory cannot be written.
    """
    found = design_motion(place_of(config, "all"), purpose_of(purpose))
    save(found, out)
    return found


def save(found: Design, out: Path) -> None:
    """Write the trajectory file.

    Raises:
        DataError: the file cannot be written.
    """
    with writing(out):
        write_trajectory(out, found.trajectory)


def report_beside(found: Design, config: Path, out: Path, settings: dict[str, Any]) -> Path:
    """Write the report of a design beside its trajectory file, as .html.

    Args:
        found: the design.
        config: the arm's file.
        out: the trajectory file.
        settings: how it was made, for the page's end.

    Raises:
        DataError: the file cannot be written.
    """
    arm = arm_from_file(find_file(config), ())
    content = {"provenance": provenance(arm, []) | {"settings": settings}}
    files = str(config), out.name
    report = DesignReport(arm.name, found.trajectory, found.quantities, found.t, content, files)
    return _page(out.with_suffix(".html"), render(design_page(report)))


def view_beside(found: Design, config: Path, out: Path) -> Path:
    """Write the view of the moving arm beside its trajectory file, as -view.html.

    Raises:
        DataError: the file cannot be written.
    """
    robot = arm_from_file(find_file(config), ()).robot
    return _page(out.with_name(f"{out.stem}-view.html"), view_page(found, robot))


def _page(path: Path, text: str) -> Path:
    write_text(path, text)
    return path
