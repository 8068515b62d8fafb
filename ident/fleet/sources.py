"""Where logs lie: folders, globs, and addresses of object stores."""

import glob
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from wamctl.arm.errors import DataError

_REMOTE = "://"
_FILES = (".mcap", ".db3", ".bag")


@dataclass(frozen=True)
class Source:
    """A log that lies somewhere.

    Attributes:
        address: path or URL.
        size: of its files [bytes]; -1 where it is not there.
        modified: when it was last changed, as the place tells it.
    """

    address: str
    size: int
    modified: str

    @property
    def folder(self) -> str:
        """Name of the folder directly above it."""
        return PurePosixPath(self.address).parent.name


def found_logs(addresses: Sequence[str]) -> list[Source]:
    """All logs at some addresses, in the order of their addresses, each once.

    A log that is named and is not there is listed too, with size -1.

    Args:
        addresses: folders, files, globs, or URLs of these, such as s3://bucket/prefix.

    Raises:
        DataError: an address without any log, or one that cannot be listed.
    """
    found: dict[str, Source] = {}
    for address in addresses:
        here = _remote(address) if _REMOTE in address else _local(address)
        if not here:
            raise DataError(
                f"{address} holds no log: name folders, globs or object-store prefixes with .mcap,"
                " .db3 or .bag files, or ROS 2 bag folders."
            )
        found |= {source.address: source for source in here}
    return [found[address] for address in sorted(found)]


def _local(address: str) -> list[Source]:
    pattern = any(c in address for c in "*?[")
    paths = [Path(p) for p in glob.glob(address, recursive=True)] if pattern else [Path(address)]
    if not pattern and not paths[0].exists():
        return [Source(address, -1, "")] if paths[0].suffix in _FILES else []
    return [_stated(log) for path in paths for log in _logs_in(path)]


def _logs_in(path: Path) -> list[Path]:
    """The logs at a path: itself, or those of a folder and the folders in it."""
    if path.is_file() or (path / "metadata.yaml").is_file():
        return [path]
    bags = {p.parent for p in path.rglob("metadata.yaml")}
    files = [p for p in path.rglob("*") if p.suffix in _FILES and p.parent not in bags]
    return [*bags, *files]


def _stated(path: Path) -> Source:
    files = [p for p in path.rglob("*") if p.is_file()] if path.is_dir() else [path]
    stats = [p.stat() for p in files]
    return Source(str(path), sum(s.st_size for s in stats), str(max(s.st_mtime_ns for s in stats)))


def _remote(address: str) -> list[Source]:
    """The logs behind a URL; bags of several files are not looked for there."""
    scheme = address.partition(_REMOTE)[0]
    try:
        system, path = _file_system(address)
        pattern = any(c in path for c in "*?[")
        paths = system.glob(path) if pattern else system.find(path)
        logs = sorted(str(p) for p in paths if str(p).endswith(_FILES))
        stats = [system.info(p) for p in logs]
    except Exception as error:  # libraries of many stores, each with errors of its own
        raise DataError(unreachable(address, error)) from error
    if not logs and not pattern and path.endswith(_FILES):
        return [Source(address, -1, "")]
    return [
        Source(f"{scheme}{_REMOTE}{p}", int(s["size"]), _version(s))
        for p, s in zip(logs, stats, strict=True)
    ]


def _version(stat: dict[str, Any]) -> str:
    return str(stat.get("ETag") or stat.get("LastModified") or stat.get("mtime") or "")


def _file_system(address: str) -> tuple[Any, str]:
    """The file system of a URL, and the path in it; its library is of the extra `[fleet]`."""
    import fsspec

    return fsspec.core.url_to_fs(address, skip_instance_cache=True)


def unreachable(address: str, error: BaseException) -> str:
    """What went wrong on the way to an object store, in a sentence."""
    words = " ".join(str(error).split()) or type(error).__name__
    if isinstance(error, FileNotFoundError):
        return f"{address} is not there: check bucket and prefix."
    refused = isinstance(error, PermissionError) or "credential" in words.lower()
    if refused:
        return (
            f"{address} cannot be read: the store refuses the credentials ({words.rstrip('.')});"
            " set them as its library wants them (for s3: AWS_ACCESS_KEY_ID and"
            " AWS_SECRET_ACCESS_KEY, or a profile)."
        )
    return f"{address} cannot be read ({words.rstrip('.')}): check address, network and library."


@contextmanager
def local_copy(address: str) -> Iterator[Path]:
    """The log as a file of this machine, for as long as the block runs.

    Raises:
        DataError: it is not there, or cannot be fetched.
    """
    if _REMOTE not in address:
        if not Path(address).exists():
            raise DataError(f"{address} is not there.")
        yield Path(address)
        return
    with tempfile.TemporaryDirectory(prefix="ident-fleet-") as folder:
        path = Path(folder) / PurePosixPath(address).name
        try:
            system, remote = _file_system(address)
            system.get_file(remote, str(path))
        except Exception as error:  # libraries of many stores, each with errors of its own
            raise DataError(unreachable(address, error)) from error
        yield path
