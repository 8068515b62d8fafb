"""The arm, from a URDF or from its configuration file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ident.model.arm import Arm as ArmModel
from ident.model.arm import arm_from_file, arm_from_urdf
from wamctl.arm.config import (
    ArmFile,
    IdentificationSection,
    RobotFile,
    find_file,
    load_robot_file,
    read_text,
)
from wamctl.arm.errors import ConfigurationError, DataError, did_you_mean
from wamctl.arm.robot import load_robot


@dataclass(frozen=True)
class Arm:
    """An arm, before any data.

    Attributes:
        name: the arm's name.
        joints: its moving joints, in the order of the kinematic chain.
        source: the file that describes it.
        urdf: the text of the URDF, where it was made from one.
        file: its configuration, where it was made from one.
        settings: identification settings that differ from the arm's own, such as `cutoff_hz`.
    """

    name: str
    joints: tuple[str, ...]
    source: str
    urdf: str | None = field(default=None, repr=False)
    file: RobotFile | ArmFile | None = field(default=None, repr=False)
    settings: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def from_urdf(
        cls, urdf: str | Path, joints: Sequence[str] | None = None, **settings: Any
    ) -> "Arm":
        """An arm from its URDF.

        Args:
            urdf: path of the file, or its text.
            joints: joints of the arm; the others are locked at zero. Default: all moving joints
                that a recording has.
            settings: identification settings, such as `cutoff_hz=10` or
                `terms=["viscous", "coulomb", "offset"]`.

        Raises:
            ConfigurationError: a file that is no URDF, or joints that it does not have.
        """
        written = isinstance(urdf, str) and urdf.lstrip().startswith("<")
        text = str(urdf) if written else read_text(find_file(urdf))
        source = "URDF" if written else str(urdf)
        found = load_robot(text, source=source)
        unknown = [j for j in joints or () if j not in found.joint_names]
        if unknown:
            raise ConfigurationError(
                source,
                [
                    f"has no joint {', '.join(unknown)}; its joints are"
                    f" {', '.join(found.joint_names)}"
                ],
            )
        chosen = tuple(found.joint_names) if joints is None else tuple(joints)
        name = found.model.name or Path(source).stem
        return cls(name, chosen, source, urdf=text, settings=settings)

    @classmethod
    def from_config(cls, config: str | Path, **settings: Any) -> "Arm":
        """An arm from its YAML file, which may say more than a URDF (transmission, filter, terms).

        Args:
            config: path of the file, or the bare name of a shipped one, such as `wam7.yaml`.
            settings: identification settings that differ from the file's.

        Raises:
            ConfigurationError: a file that cannot be used.
        """
        path = find_file(Path(config))
        file = load_robot_file(path)
        arm = arm_from_file(path, ())
        return cls(file.arm, arm.robot.joint_names, str(path), file=file, settings=settings)

    def of_recording(self, joints: Sequence[str], **settings: Any) -> ArmModel:
        """The robot and its settings for a recording of these joints.

        Args:
            joints: joints of the recording.
            settings: identification settings that differ from the arm's.

        Raises:
            ConfigurationError: an unknown setting, or a value out of its bounds.
            DataError: the recording has none of the arm's joints.
        """
        if self.urdf is None:
            arm = arm_from_file(Path(self.source), tuple(joints))
        else:
            shared = tuple(j for j in self.joints if j in joints)
            if not shared:
                raise DataError(
                    f"The recording's joints ({', '.join(joints)}) are not those of"
                    f" {self.source} ({', '.join(self.joints)}); name them alike."
                )
            arm = arm_from_urdf(self.urdf, shared, self.source)
        return arm.with_settings(**_known({**self.settings, **settings}))


def _known(settings: dict[str, Any]) -> dict[str, Any]:
    """The settings, all of which exist.

    Raises:
        ConfigurationError: an unknown one; the sentence names the nearest that exists.
    """
    valid = sorted(IdentificationSection.model_fields)
    unknown = [name for name in settings if name not in valid]
    if unknown:
        hint = did_you_mean(unknown[0], valid) or f"; valid are {', '.join(valid)}"
        raise ConfigurationError("settings", [f"there is no setting {unknown[0]}{hint}"])
    return settings
