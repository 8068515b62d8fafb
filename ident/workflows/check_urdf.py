"""The work of `ident check-urdf`: a URDF, and perhaps recordings of its arm."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ident.checks.remark import RefusedError, verdict_content
from ident.model.arm import Arm
from ident.recordings.dataset import Dataset
from ident.recordings.loading import Reading, read_logs
from ident.regression.progress import Tell, silent
from ident.urdf_check.examine import Examination, examine_urdf
from ident.urdf_check.finding import Grade
from ident.urdf_check.joints import Ranges
from ident.urdf_check.masses import Weighed, weighed
from ident.workflows.run import run_data
from wamctl.arm.config import find_file, read_text
from wamctl.arm.errors import write_text


@dataclass(frozen=True)
class UrdfCheck:
    """What was found.

    Attributes:
        file: the URDF.
        out: where the repaired one was written, if anywhere.
        examined: what the file alone says.
        weighed: what the recordings say of its masses; None without recordings, or where they
            were refused, or without masses.
        recording: verdict and remarks of the recordings' check, and the errors of the URDF's own
            and of identified parameters, None where the URDF has none; empty without recordings.
    """

    file: Path
    out: Path | None
    examined: Examination
    weighed: Weighed | None
    recording: dict[str, Any]

    @property
    def verdict(self) -> str:
        """`possible`, `repaired` or `impossible`."""
        left = self.examined.faults_left if self.out else self.examined.faults
        if left:
            return "impossible"
        return "repaired" if self.examined.faults else "possible"

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        count = len(self.examined.faults)
        noun = f"{count} fault{'s' * (count != 1)}"
        if not count and self.weighed is not None and self.weighed.contradictions:
            wrong = len(self.weighed.contradictions)
            return (
                f"{self.file}: such an arm can exist, but {wrong} of its masses"
                f" {'is' if wrong == 1 else 'are'} contradicted.{self._written}"
            )
        if not count and self.examined.findings:
            seen = f"but see the {self._less_than_faults} above"
            return f"{self.file}: no fault was found, {seen}.{self._written}"
        if not count:
            return f"{self.file}: such an arm can exist; no fault was found.{self._written}"
        if self.verdict == "repaired":
            return f"{self.file}: {noun}, all repaired in {self.out}."
        mendable = count - len(self.examined.faults_left)
        if not mendable:
            why = "which cannot be repaired without knowing what is meant"
            return f"{self.file}: {noun}, {why}.{self._written}"
        words = f"{self.file}: {noun}, of which {mendable} can be repaired"
        return words + (f" and were in {self.out}." if self.out else " (--out FILE writes it).")

    @property
    def _less_than_faults(self) -> str:
        """How many doubts and notes there are, such as `doubt` or `2 doubts and 3 notes`."""
        grades = [finding.grade for finding in self.examined.findings]
        counts = [(g, grades.count(g)) for g in (Grade.DOUBT, Grade.NOTE) if g in grades]
        if len(counts) == 1 and counts[0][1] == 1:
            return counts[0][0].value
        return " and ".join(f"{n} {g.value}{'s' * (n != 1)}" for g, n in counts)

    @property
    def _written(self) -> str:
        """What a written file holds beside the faults, as one more sentence; empty without one."""
        if self.out is None:
            return ""
        count = sum(finding.repair is not None for finding in self.examined.findings)
        if not count:
            return f" {self.out} holds the same: nothing was repaired."
        return f" {self.out} holds {count} repair{'s' * (count != 1)}."

    def content(self) -> dict[str, Any]:
        """For JSON."""
        masses = () if self.weighed is None else self.weighed.contradictions
        return {
            "file": str(self.file),
            "out": None if self.out is None else str(self.out),
            "verdict": self.verdict,
            "findings": [finding.content() for finding in self.examined.findings],
            "left": [finding.content() for finding in self.examined.left],
            "masses": [mass.content() for mass in masses],
            "unseen_masses": [] if self.weighed is None else list(self.weighed.unseen),
            "recording": self.recording or None,
        }


def check_urdf(
    file: Path, logs: Sequence[Path], out: Path | None, reading: Reading, tell: Tell = silent
) -> UrdfCheck:
    """Examine a URDF, and compare it with recordings of its arm.

    Args:
        file: the URDF; a bare name finds a shipped one.
        logs: recordings, if any.
        out: where to write the repaired URDF, if anywhere.
        reading: what to read of the recordings.
        tell: hears what is being done.

    Raises:
        ConfigurationError: no URDF, or one that stays unreadable although recordings are given.
        DataError: recordings that cannot be used, or a file that cannot be written.
    """
    path = find_file(file)
    text = read_text(path)
    examined = examine_urdf(text, path)
    compared, recording = None, {}
    if logs:
        tell("reading")
        arm, data = _read(path.name, examined.repaired, logs, reading)
        first, examined = examined, examine_urdf(text, path, _ranges(data))
        if examined.repaired != first.repaired:
            arm, data = _read(path.name, examined.repaired, logs, reading)
        compared, recording = _compared(arm, data, tell)
    if out is not None:
        write_text(out, examined.repaired)
    return UrdfCheck(path, out, examined, compared, recording)


def _read(
    name: str, urdf: str, logs: Sequence[Path], reading: Reading
) -> tuple[Arm, list[Dataset]]:
    """Recordings of the arm of a URDF that is not, or not so, a file."""
    with tempfile.TemporaryDirectory() as folder:
        repaired = Path(folder) / name
        repaired.write_text(urdf, encoding="utf-8")
        return read_logs(logs, repaired, reading)


def _ranges(data: Sequence[Dataset]) -> Ranges:
    """Where the recordings have the joints, all of them together."""
    found: dict[str, tuple[float, float]] = {}
    for one in data:
        rows = zip(one.source.joint_names, one.source.low, one.source.high, strict=True)
        for name, low, high in rows:
            before = found.get(name, (low, high))
            found[name] = (float(min(low, before[0])), float(max(high, before[1])))
    return found


def _compared(
    arm: Arm, data: Sequence[Dataset], tell: Tell
) -> tuple[Weighed | None, dict[str, Any]]:
    """What recordings say of the masses, and of the URDF as a whole."""
    try:
        run = run_data(arm, data, tell)
    except RefusedError as refusal:
        return None, verdict_content(refusal.remarks)
    has_masses = "cad" in run.found.assessments
    errors = {
        name: run.found.assessments[key].filtered.relative_percent if known else None
        for name, key, known in (
            ("urdf", "cad", has_masses),
            ("identified", run.found.chosen, True),
        )
    }
    recording = {key: run.content[key] for key in ("verdict", "remarks")}
    compared = weighed(run.found) if has_masses else None
    return compared, recording | {"relative_error_percent": errors}
