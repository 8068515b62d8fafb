"""The funnel's last stage: `ident gap` on the logs of an arm that has changed."""

import json
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

from ident.fleet.series import ArmResult, Entry, Series
from ident.fleet.settings import FleetSettings
from ident.fleet.sources import local_copy
from ident.fleet.store import key_of
from ident.gap.options import Options
from ident.recordings.loading import Reading
from ident.regression.progress import Tell
from ident.workflows.gap import gap_logs
from ident.workflows.run import run_logs
from wamctl.arm.errors import UserError

FOLDER = "gaps"
_DONE = "asked.json"


@dataclass(frozen=True)
class Asking:
    """How changed arms are looked at.

    Attributes:
        out: folder of the fleet's results.
        robot: file that describes the arms; None: what travels inside the logs.
        reading: topics and torque to read.
        settings: of the fleet.
        tell: hears what is being done.
    """

    out: Path
    robot: Path | None
    reading: Reading
    settings: FleetSettings
    tell: Tell

    def of(self, series: Series, result: ArmResult) -> dict[str, Any]:
        """What `ident gap` says of an arm's first change.

        The model that is trusted is fitted to the last logs before the change, and the gap is
        searched on the first logs after it, up to the next change. What was asked before of the
        same logs is not asked again.

        Args:
            series: the arm.
            result: with at least one change.
        """
        most = self.settings.gap_logs
        first, *later = sorted({c.onset for c in result.changes})
        before = series.entries[max(0, first - most) : first]
        after = series.entries[first : min([*later, first + most])]
        folder = self.out / FOLDER / quote(series.arm, safe="")
        digests = [e.stored.reduced.hash for e in (*before, *after)]
        key = key_of(first, len(before), digests, str(self.robot), self.reading)
        known = _known(folder / _DONE)
        if known.get("key") != key:
            self.tell(f"searching the gap of {series.arm}")
            known = {"key": key} | self._asked(before, after, folder)
            folder.mkdir(parents=True, exist_ok=True)
            (folder / _DONE).write_text(json.dumps(known, indent=2), encoding="utf-8")
        return {name: value for name, value in known.items() if name != "key"}

    def _asked(
        self, before: Sequence[Entry], after: Sequence[Entry], folder: Path
    ) -> dict[str, Any]:
        """The verdict with its effects; where the logs do not allow one, a sentence."""
        try:
            with ExitStack() as stack:
                old, new = (
                    [stack.enter_context(local_copy(e.stored.source.address)) for e in part]
                    for part in (before, after)
                )
                run_logs(old, self.robot, folder / "trusted", self.reading)
                trusted = folder / "trusted" / "model.yaml"
                known = (self.robot, trusted)
                text, said = gap_logs(new, known, folder, self.reading, Options(), lambda _: None)
        except UserError as error:
            return {"verdict": "refused", "effects": [], "sentences": [str(error)], "report": None}
        found = json.loads(text)
        effects = [{"name": e["name"], "joints": e["joints"]} for e in found["effects"]]
        report = f"{FOLDER}/{folder.name}/report.html"
        return {
            "verdict": found["verdict"],
            "effects": effects,
            "sentences": said,
            "report": report,
            "logs": [len(before), len(after)],
        }


def _known(path: Path) -> dict[str, Any]:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
