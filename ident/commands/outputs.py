"""What stands where a command writes: checked before the work, and kept when it is replaced."""

import json
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from wamctl.arm.command_line import is_quiet
from wamctl.arm.errors import DataError

_KEPT = "previous"
_LOG = ".mcap"


@contextmanager
def folder_written(out: Path, names: Sequence[str], force: bool) -> Iterator[None]:
    """Results of an earlier run in a folder move to `previous` in it when others replace them.

    A repetition with the same outcome, but for times, just replaces them.

    Args:
        out: the folder.
        names: files that the block writes there, the first one JSON, and folders of files.
        force: keep nothing.

    Raises:
        DataError: the folder cannot be written.
    """
    _check_folder(out)
    before = _outcome(out / names[0])
    with _copies([] if force else _files(out, names), out) as copies:
        try:
            yield
        finally:
            if before is None or before != _outcome(out / names[0]):
                _keep([pair for pair in copies if _differ(*pair)], out)


@contextmanager
def file_written(out: Path, force: bool) -> Iterator[None]:
    """A file that the block replaces by another one is kept beside it, as NAME.previous.EXT.

    Args:
        out: the file.
        force: keep nothing.

    Raises:
        DataError: the file cannot be written.
    """
    _check_file(out)
    with _copies([] if force else [out], out.parent) as copies:
        yield
        for old, copy in copies:
            if _differ(old, copy):
                kept = old.with_name(f"{old.stem}.{_KEPT}{old.suffix}")
                os.replace(copy, kept)
                _note(f"{old} was there already; the earlier one is now {kept}")


@contextmanager
def log_written(out: Path, force: bool) -> Iterator[None]:
    """A log that the block writes, as `file_written`, under a name that tells what it is.

    Args:
        out: the file.
        force: keep nothing.

    Raises:
        DataError: the file cannot be written, or its name ends otherwise.
    """
    _check_file(out)
    if out.suffix != _LOG:
        raise DataError(
            f"{out} is to hold a log, whose name ends in {_LOG}: write --out"
            f" {out.with_suffix(_LOG)}."
        )
    with file_written(out, force):
        yield


def _files(out: Path, names: Sequence[str]) -> list[Path]:
    """The files of those names, and all files in the folders of those names."""
    paths = [out / name for name in names]
    inside = [found for path in paths if path.is_dir() for found in sorted(path.rglob("*"))]
    return [path for path in [*paths, *inside] if path.is_file()]


def _check_folder(out: Path) -> None:
    place = out
    while not place.exists() and place != place.parent:
        place = place.parent
    if not place.is_dir():
        raise DataError(f"{out} cannot be written ({place} is no folder): name another with --out.")
    _check_writable(out, place)


def _check_file(out: Path) -> None:
    if out.is_dir():
        raise DataError(f"{out} cannot be written (it is a folder): name a file with --out.")
    if not out.parent.is_dir():
        raise DataError(
            f"{out} cannot be written (there is no folder {out.parent}): make it, or name another"
            " file with --out."
        )
    _check_writable(out, out.parent)


def _check_writable(out: Path, place: Path) -> None:
    if not os.access(place, os.W_OK | os.X_OK):
        raise DataError(
            f"{out} cannot be written (no right to write in {place}): name another with --out."
        )


@contextmanager
def _copies(paths: Sequence[Path], place: Path) -> Iterator[list[tuple[Path, Path]]]:
    """Copies of those files that are there, beside them, so that a rename keeps one."""
    there = [path for path in paths if path.is_file()]
    if not there:
        yield []
        return
    with tempfile.TemporaryDirectory(prefix=".earlier-", dir=place) as folder:
        copies = [(path, Path(folder) / path.relative_to(place)) for path in there]
        for path, copy in copies:
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(path, copy)
        yield copies


def _keep(replaced: Sequence[tuple[Path, Path]], out: Path) -> None:
    for old, copy in replaced:
        kept = out / _KEPT / old.relative_to(out)
        kept.parent.mkdir(parents=True, exist_ok=True)
        os.replace(copy, kept)
    if replaced:
        _note(f"earlier results were there; they are now in {out / _KEPT}")


def _differ(old: Path, copy: Path) -> bool:
    return not old.is_file() or old.read_bytes() != copy.read_bytes()


def _outcome(path: Path) -> object:
    """The content of a result file without times; None where there is none."""
    try:
        return _timeless(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError):
        return None


def _timeless(content: object) -> object:
    if isinstance(content, dict):
        return {key: _timeless(value) for key, value in content.items() if key != "seconds"}
    return content


def _note(sentence: str) -> None:
    if not is_quiet():
        sys.stderr.write(f"note: {sentence} (--force replaces without keeping).\n")
