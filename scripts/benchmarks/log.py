"""Cost of writing and reading a log of 60 s at 500 Hz, beside the MCAP library's own.

Usage: .venv/bin/python scripts/benchmarks/log.py
"""

import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros2.decoder import DecoderFactory

from wamctl.arm.recorder import CycleRecord, Recorder
from wamctl.arm.recording import read_recording

CYCLES = 30_000
JOINTS = [f"wam/joint_{k}_with_a_long_name" for k in range(7)]


def write(path: Path, rows: np.ndarray) -> None:
    """Three messages a cycle with our recorder."""
    with Recorder(path, JOINTS) as recorder:
        for k, row in enumerate(rows):
            recorder.cycle(CycleRecord(k * 2_000_000, row, row, None, row, row, row, row))


def write_with_library(path: Path, content: list[bytes]) -> None:
    """The same number of finished messages with the library's writer."""
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=130_000, enable_data_crcs=True)
        writer.start("ros2")
        schema = writer.register_schema("x", "ros2msg", b"")
        channel = writer.register_channel("/x", "cdr", schema)
        for k in range(CYCLES):
            for data in content:
                writer.add_message(channel, k * 2_000_000, data, k * 2_000_000)
        writer.finish()


def decode_with_library(path: Path) -> int:
    """All messages with the library's reader and decoder."""
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        return sum(1 for _ in reader.iter_decoded_messages())


def seconds(action: Callable[[], object], times: int) -> float:
    """Processor time of the fastest of some runs [s]."""
    spent = []
    for _ in range(times):
        start = time.process_time()
        action()
        spent.append(time.process_time() - start)
    return min(spent)


def main() -> None:
    """Prints the four figures."""
    rows = np.random.default_rng(0).normal(size=(CYCLES, 7))
    with TemporaryDirectory() as folder:
        ours, theirs = Path(folder, "ours.mcap"), Path(folder, "theirs.mcap")
        written = seconds(lambda: write(ours, rows), 3)
        with ours.open("rb") as stream:
            messages = make_reader(stream).iter_messages()
            content = [message.data for _, (_, _, message) in zip(range(3), messages, strict=False)]
        library = seconds(lambda: write_with_library(theirs, content), 3)
        read = seconds(lambda: read_recording(ours), 5)
        decoded = seconds(lambda: decode_with_library(ours), 1)
    print(f"write: {written / CYCLES * 1e6:.1f} us a cycle of three messages")
    print(
        f"       {library / CYCLES * 1e6:.1f} us for the library's writer, messages encoded before"
    )
    print(f"read:  {read:.3f} s for {CYCLES} cycles")
    print(f"       {decoded:.3f} s for the library's reader and decoder")


if __name__ == "__main__":
    main()
