"""The work of `ident check-urdf`: a URDF, and perhaps recordings of its arm."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ident.checks.remark import RefusedError, verdict_content
from ident.recordings.loading import Reading, read_logs
from ident.regression.progress import Tell, silent
from ident.urdf_check.examine import Examination, examine_urdf
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
        if not count:
            doubts = len(self.examined.findings)
            which = "doubt" if doubts == 1 else f"{doubts} doubts"
            if doubts:
                return f"{self.file}: no fault was found, but see the {which} above.{self._written}"
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
    examined = examine_urdf(read_text(path), path)
    if out is not None:
        write_text(out, examined.repaired)
    if not logs:
        return UrdfCheck(path, out, examined, None, {})
    compared, recording = _compared(path.name, examined.repaired, logs, reading, tell)
    return UrdfCheck(path, out, examined, compared, recording)


def _compared(
    name: str, urdf: str, logs: Sequence[Path], reading: Reading, tell: Tell
) -> tuple[Weighed | None, dict[str, Any]]:
    tell("reading")
    with tempfile.TemporaryDirectory() as folder:
        repaired = Path(folder) / name
        repaired.write_text(urdf, encoding="utf-8")
        arm, data = read_logs(logs, repaired, reading)
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
