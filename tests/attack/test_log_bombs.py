"""Recordings made to fill memory or to hang the reader, and records that are short or lie."""

import io
import resource
import sqlite3
import struct
import subprocess
import sys
import zipfile
import zlib

import lz4.frame
import numpy as np
import pytest
import scipy.io
import zstandard

from ident.importers.tables import read_table
from ident.importers.text_form import TextForm
from wamctl.arm.errors import DataError
from wamctl.arm.recorder import CycleRecord, Recorder
from wamctl.arm.recording import read_recording
from wamctl.arm.ros2.mcap_bag import MAGIC

ZEROS = b"\0" * (1 << 20)


def record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


def chunk(size: int, compression: str, packed: bytes) -> bytes:
    name = compression.encode()
    head = struct.pack("<QQQII", 0, 0, size, 0, len(name)) + name + struct.pack("<Q", len(packed))
    return record(6, head + packed)


def packed_zeros(compression: str, megabytes: int) -> bytes:
    if compression == "zstd":
        packer = zstandard.ZstdCompressor(level=19).compressobj()
    else:
        packer = lz4.frame.LZ4FrameCompressor()
    out = packer.begin() if compression == "lz4" else b""
    out += b"".join(packer.compress(ZEROS) for _ in range(megabytes))
    return out + packer.flush()


def in_little_memory(code: str, *arguments: object) -> str:
    """What a program prints that may not have more than 1.5 GB, nor more than 60 s of a core."""
    most = 3 << 29

    def bounded() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
        resource.setrlimit(resource.RLIMIT_CPU, (60, 60))

    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        preexec_fn=bounded,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


READ = """
import sys
from wamctl.arm.errors import DataError
from wamctl.arm.recording import read_recording
try:
    read_recording(sys.argv[1])
except DataError as error:
    print(error)
"""


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
@pytest.mark.parametrize("stated", ["true", "small"])
def test_a_chunk_that_unpacks_to_a_gigabyte(tmp_path, compression, stated):
    bomb = tmp_path / "bomb.mcap"
    packed = packed_zeros(compression, 1024)
    size = 1 << 30 if stated == "true" else 1000
    bomb.write_bytes(MAGIC + chunk(size, compression, packed) * 3)
    said = in_little_memory(READ, bomb)
    assert ("unpacks to more than" if stated == "true" else "fails its check") in said


def test_many_chunks_that_are_small_enough_each(tmp_path):
    bomb = tmp_path / "bomb.mcap"
    bomb.write_bytes(MAGIC + chunk(1 << 27, "zstd", packed_zeros("zstd", 128)) * 40)
    assert "unpacks to more than" in in_little_memory(READ, bomb)


@pytest.mark.parametrize("opcode", range(256))
def test_records_of_every_kind_that_are_too_short(tmp_path, opcode):
    for length in (0, 1, 3, 8, 21):
        for wrapped in (False, True):
            body = record(opcode, b"\xff" * length)
            path = tmp_path / "short.mcap"
            path.write_bytes(MAGIC + (chunk(len(body), "", body) if wrapped else body))
            with pytest.raises(DataError):
                read_recording(path)


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> bytes:
    path = tmp_path_factory.mktemp("log") / "log.mcap"
    with Recorder(path, ("a", "b"), {"x": "y"}, {"note.txt": b"kept"}) as recorder:
        for k in range(200):
            q = np.array([np.sin(0.1 * k), k * 1e-3])
            recorder.cycle(CycleRecord(k * 2_000_000, q, q, None, q, q, q, q))
    return path.read_bytes()


@pytest.mark.parametrize("seed", range(40))
def test_flipped_bytes_and_lying_lengths(tmp_path, whole, seed):
    rng = np.random.default_rng(seed)
    data = bytearray(whole)
    for place in rng.integers(len(MAGIC), len(data), rng.integers(1, 6)):
        data[place] = rng.integers(256)
    if seed % 2:
        place = int(rng.integers(len(MAGIC), len(data) - 8))
        data[place : place + 8] = struct.pack("<Q", int(rng.integers(2**62)))
    path = tmp_path / "bent.mcap"
    path.write_bytes(data)
    try:
        read_recording(path)
    except DataError as error:
        assert str(path) in str(error)  # noqa: PT017


def database(path, *statements: str) -> None:
    with sqlite3.connect(path) as made:
        for text in statements:
            made.execute(text)
    made.close()


TOPICS = "CREATE TABLE topics (id INTEGER, name TEXT, type TEXT, serialization_format TEXT)"
TOPIC = "INSERT INTO topics VALUES (1, '/joint_states', 'sensor_msgs/msg/JointState', 'cdr')"
ENDLESS = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n)"


@pytest.mark.parametrize(
    "messages",
    [
        f"CREATE VIEW messages AS {ENDLESS} SELECT i AS id, 1 AS topic_id, i AS timestamp,"
        " zeroblob(1000000) AS data FROM n",
        "CREATE TABLE messages (id INTEGER, topic_id INTEGER, timestamp INTEGER,"
        " data BLOB GENERATED ALWAYS AS (zeroblob(900000000)))",
        "CREATE TABLE messages (id INTEGER, topic_id INTEGER, timestamp INTEGER, data INTEGER)",
    ],
)
def test_databases_that_are_endless_or_hold_no_messages(tmp_path, messages):
    bomb = tmp_path / "bomb.db3"
    rows = [] if "VIEW" in messages else ["INSERT INTO messages VALUES (1, 1, 1, 7)"]
    if "GENERATED" in messages:
        rows = ["INSERT INTO messages (id, topic_id, timestamp) VALUES (1, 1, 1)"]
    database(bomb, TOPICS, TOPIC, messages, *rows)
    assert str(bomb) in in_little_memory(READ, bomb)


def refused(path) -> str:
    with pytest.raises(DataError) as error:
        read_table(path, ["q"], TextForm())
    return str(error.value)


def test_an_archive_of_zeros(tmp_path):
    bomb = tmp_path / "bomb.npz"
    with (
        zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("q.npy", "w", force_zip64=True) as entry,
    ):
        for _ in range(400):
            entry.write(ZEROS)
    assert "unpacks to more than" in refused(bomb)


def test_an_archive_that_states_an_array_without_end(tmp_path):
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        head, {"descr": "<f8", "fortran_order": False, "shape": (10**15,)}
    )
    bomb = tmp_path / "bomb.npz"
    with zipfile.ZipFile(bomb, "w") as archive:
        archive.writestr("q.npy", head.getvalue())
    assert "is not a readable .npz archive" in refused(bomb)


def test_a_matlab_file_of_zeros(tmp_path):
    bomb = tmp_path / "bomb.mat"
    scipy.io.savemat(bomb, {"q": np.zeros(10)})
    packed = zlib.compress(ZEROS * 400, 9)
    bomb.write_bytes(bomb.read_bytes()[:128] + struct.pack("<II", 15, len(packed)) + packed)
    assert "unpacks to more than" in refused(bomb)


@pytest.mark.parametrize("seed", range(30))
def test_bent_matlab_files(tmp_path, seed):
    rng = np.random.default_rng(seed)
    path = tmp_path / "bent.mat"
    scipy.io.savemat(path, {"q": np.arange(50.0), "s": {"t": 1.0}}, do_compression=seed % 2 == 0)
    data = bytearray(path.read_bytes())
    for place in rng.integers(120, len(data), 4):
        data[place] = rng.integers(256)
    path.write_bytes(data)
    try:
        read_table(path, ["q"], TextForm())
    except DataError as error:
        assert str(path) in str(error)  # noqa: PT017
