"""What a command has found, and writing a folder of results all at once."""

import importlib.metadata
import platform
import shutil
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from ident.checks.remark import RefusedError, gravest_first, verdict_content
from ident.model.arm import Arm
from ident.recordings.dataset import Dataset
from ident.recordings.loading import fingerprint
from ident.report.page import Page, Verdict, render
from ident.workflows.run_json import as_json
from wamctl.arm.command_line import git_commit
from wamctl.arm.errors import writing

_LIBRARIES = ("numpy", "scipy", "pin", "clarabel")

_MODEL = "model.yaml"


def provenance(arm: Arm, paths: Sequence[Path]) -> dict[str, Any]:
    """Facts for a result file.

    Args:
        arm: robot and settings.
        paths: the logs.
    """
    return {
        "program": {
            "wam-ident": importlib.metadata.version("wam-ident"),
            "commit": git_commit(),
            "python": platform.python_version(),
        }
        | {name: importlib.metadata.version(name) for name in _LIBRARIES},
        "arm": {"name": arm.name, "described in": arm.source},
        "logs": {str(path): fingerprint(path) for path in paths},
        "settings": arm.settings.model_dump(mode="json"),
    }


@contextmanager
def whole_folder(out: Path, names: tuple[str, ...]) -> Iterator[Path]:
    """A temporary folder whose files move to `out` when all of them are there, and not before.

    Raises:
        DataError: the folder cannot be written.
    """
    with writing(out):
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".unfinished-", dir=out) as folder:
            yield Path(folder)
            for name in names:
                shutil.move(Path(folder) / name, out / name)


def write_results(
    out: Path,
    command: str,
    content: dict[str, Any],
    page: str,
    write_model: Callable[[Path], None] | None = None,
) -> str:
    """Write a command's JSON file, its report, and its model; gives the content of the JSON file.

    Args:
        out: folder for the results.
        command: `run`, `validate`, or `gap`; also the name of the JSON file.
        content: of the JSON file.
        page: the report.
        write_model: writes `model.yaml`; None where there is no model.

    Raises:
        DataError: the folder cannot be written.
    """
    text, result = as_json(content), f"{command}.json"
    names = (result, *(("model.yaml",) if write_model else ()), "report.html")
    with whole_folder(out, names) as folder:
        if write_model is not None:
            write_model(folder / "model.yaml")
        (folder / "report.html").write_text(page, encoding="utf-8")
        (folder / result).write_text(text, encoding="utf-8")
    return text


@dataclass(frozen=True)
class Work(ABC):
    """What a command has found, and everything that is written about it.

    Attributes:
        model: the content of `model.yaml`.
        content: the content of the command's JSON file.
    """

    command: ClassVar[str]

    model: Any
    content: dict[str, Any]

    @abstractmethod
    def page(self) -> str:
        """The report, one HTML page."""

    def write(self, out: Path, page: str | None = None) -> str:
        """Write the JSON file, `model.yaml` and `report.html`; gives the content of the first.

        Args:
            out: folder for the results.
            page: the report, where it has been made already.

        Raises:
            DataError: the folder cannot be written.
        """
        page = self.page() if page is None else page
        return write_results(out, self.command, self.content, page, self.model.save)


@dataclass(frozen=True)
class Search(Work):
    """The same of `ident gap`."""

    command: ClassVar[str] = "gap"

    @property
    @abstractmethod
    def sentences(self) -> list[str]:
        """The verdict in sentences."""


def refused_run(arm: Arm, data: Sequence[Dataset], refusal: RefusedError) -> dict[str, Any]:
    """The content of `run.json` without an identification."""
    return verdict_content(refusal.remarks) | {
        "method": "regression",
        "arm": arm.name,
        "samples": sum(d.samples for d in data),
        "joints": list(arm.robot.joint_names),
        "sample_rate_hz": data[0].rate_hz,
        "logs": recordings_content(data),
    }


def recordings_content(data: Sequence[Dataset]) -> list[dict[str, Any]]:
    """The recordings of a search or a refusal, and what was repaired or left out of each."""
    return [{"name": d.name, "samples": d.samples, "remarks": list(d.facts)} for d in data]


def write_refusal(
    out: Path, command: str, refusal: RefusedError, content: dict[str, Any], arm: str
) -> None:
    """Write the result file and a page with the reasons; a model of an earlier run goes.

    Args:
        out: folder for the results.
        command: `run`, `validate`, or `gap`; also the name of the result file.
        refusal: the reasons.
        content: of the result file.
        arm: its name.

    Raises:
        DataError: the folder cannot be written.
    """
    first, *others = (r.sentence for r in gravest_first(refusal.remarks))
    verdict = Verdict("bad", "refused", first, others)
    page = Page(f"ident {command}", f"{arm}: no result", verdict, [], [])
    write_results(out, command, content, render(page))
    if command != "validate":
        (out / _MODEL).unlink(missing_ok=True)
