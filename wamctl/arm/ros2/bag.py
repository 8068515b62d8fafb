"""A bag as raw messages of ROS 2, in the order of its files."""

from collections.abc import Collection, Iterator
from pathlib import Path

import yaml

from wamctl.arm.errors import DataError
from wamctl.arm.ros2 import mcap_bag, ros1_bag, sqlite_bag
from wamctl.arm.ros2.part import Part

_ZSTD = b"\x28\xb5\x2f\xfd"


def parts(path: Path | str, topics: Collection[str]) -> Iterator[Part]:
    """What is in a bag, in the order of the file.

    Args:
        path: an `.mcap` or `.db3` file, a rosbag2 folder with `metadata.yaml`, or ROS 1's `.bag`.
        topics: the topics whose messages are wanted; all others are only named.

    Raises:
        DataError: missing, not a bag, or damaged inside.
    """
    for file in _files(Path(path)):
        with file.open("rb") as stream:
            head = stream.read(len(sqlite_bag.MAGIC))
            if head == sqlite_bag.MAGIC:
                yield from sqlite_bag.sqlite_parts(file, topics)
            elif head.startswith(mcap_bag.MAGIC):
                yield from mcap_bag.mcap_parts(file, stream, topics)
            elif head.startswith(ros1_bag.MAGIC):
                yield from ros1_bag.ros1_parts(file, topics)
            else:
                raise DataError(_no_bag(file, head))


def _files(path: Path) -> list[Path]:
    if path.is_dir():
        return _files_of_folder(path)
    if not path.exists():
        raise DataError(f"{path} does not exist: give an .mcap or .db3 file, or a bag's folder.")
    return [path]


def _files_of_folder(folder: Path) -> list[Path]:
    try:
        content = yaml.safe_load((folder / "metadata.yaml").read_text(encoding="utf-8"))
        names = content["rosbag2_bagfile_information"]["relative_file_paths"]
        files = [folder / name for name in names]
    except OSError as error:
        raise DataError(
            f"{folder} is a folder without metadata.yaml:"
            " give the folder of a ROS 2 bag, or an .mcap file."
        ) from error
    except (yaml.YAMLError, KeyError, TypeError) as error:
        raise DataError(
            f"{folder / 'metadata.yaml'} does not name the bag's files (relative_file_paths)."
        ) from error
    missing = [str(f) for f in files if not f.is_file()]
    if missing:
        raise DataError(f"{folder / 'metadata.yaml'} names missing files: {', '.join(missing)}.")
    return files


def _no_bag(file: Path, head: bytes) -> str:
    if not head:
        return f"{file} is empty (0 bytes)."
    if head.startswith(_ZSTD):
        return f"{file} is compressed as a whole: unpack it with `zstd -d`, and give the result."
    return (
        f"{file} is no bag of ROS: give an .mcap, .db3 or .bag file,"
        " or make a log of a table with `ident import`."
    )
