# ruff: noqa: SLF001 - it puts itself between the loop and its cycle
"""A bug at any line of a cycle: how long does torque of before act on the arm?

Usage: scripts/benchmarks/injected_errors.py PROTOCOL [--cycle N] [--every K] [--first K]

PROTOCOL is canopen or puck; from the root, with .venv's Python. One cycle of the moving arm (the
N-th; 900 without it) is traced once, to count the lines of `wamctl` that it runs. Then, for every
K-th of these lines, an experiment in lockstep on the embedded bus raises an exception there that
nobody expects. What counts is what the simulated drives make of it: for how many periods after the
cycle's start a torque other than zero still acts, and whether all drives are off in the end.
"""

import argparse
import io
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, suppress
from pathlib import Path
from types import FrameType
from typing import Any

import yaml
from fault_matrix import PROTOCOLS, configuration, prepared_once
from fault_verdict import PERIOD_NS
from fault_witness import Case, Testimony, served

from wamctl.arm.errors import UserError
from wamctl.errors import DrivesError
from wamctl.experiment.excite import ExciteRequest, excite
from wamctl.experiment.loop import Loop
from wamctl.experiment.session import Setup

ROOT = str(Path(__file__).parents[2] / "wamctl")
NEVER = 10**9


class InjectedError(Exception):
    """A bug that nobody expects."""


class Injector:
    """Traces one cycle, and raises at one of its lines.

    Attributes:
        lines: how many lines of `wamctl` the cycle has run.
        where: the line that was hit; empty if none was.
        at_ns: time of the cycle's start since the first one; 0 before.
    """

    def __init__(self, cycle: int, line: int) -> None:
        self.lines, self.where, self.at_ns = 0, "", 0
        self._cycle, self._line, self._seen = cycle, line, 0

    @contextmanager
    def installed(self) -> Iterator[None]:
        """Every cycle passes by here."""
        whole = Loop._cycle

        def cycle(loop: Loop, *arguments: Any) -> Any:
            self._seen += 1
            if self._seen != self._cycle:
                return whole(loop, *arguments)
            self.at_ns = loop._last_ns - loop._first_ns + PERIOD_NS
            sys.settrace(self._on_call)
            try:
                return whole(loop, *arguments)
            finally:
                sys.settrace(None)

        Loop._cycle = cycle
        try:
            yield
        finally:
            Loop._cycle = whole

    def _on_call(self, frame: FrameType, event: str, argument: object) -> Any:
        return self._on_line if frame.f_code.co_filename.startswith(ROOT) else None

    def _on_line(self, frame: FrameType, event: str, argument: object) -> Any:
        if event == "line":
            self.lines += 1
            if self.lines == self._line:
                name = Path(frame.f_code.co_filename).relative_to(ROOT)
                self.where = f"{name}:{frame.f_lineno}"
                raise InjectedError
        return self._on_line


def run(config: Path, injector: Injector) -> Testimony | None:
    """One experiment; None if the set-up, which runs in real time, did not get through."""
    with tempfile.TemporaryDirectory() as box:
        folder = Path(box)
        case = Case(config, 0, folder / "faults.yaml", folder / "bus")
        case.faults.write_text(yaml.safe_dump({"faults": []}))
        prepared, log = prepared_once(config), folder / "log.mcap"
        with served(case) as court, injector.installed():
            setup = Setup(config, prepared.arm, f"simbus:{case.socket}", lockstep=True)
            request = ExciteRequest(prepared, setup, log, lambda _: None, tests_motors=False)
            busy = False
            with redirect_stderr(io.StringIO()):
                try:
                    with suppress(InjectedError):
                        excite(request)
                except DrivesError:
                    busy = True
                except UserError:
                    pass  # the bug was taken for a stop of another kind
            testimony = court.hear()
        return None if busy else testimony


def periods_of_torque(seen: Testimony, at_ns: int) -> float:
    """For how many periods after a cycle's start any torque still acted."""
    start_ns = seen.first_ns + at_ns
    torque = [s.until_ns for s in seen.spans if s.until_ns > start_ns and any(s.torques)]
    return (max(torque) - start_ns) / PERIOD_NS if torque else 0.0


def main() -> int:
    """The distribution, and every line beyond two periods."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("protocol", choices=PROTOCOLS)
    parser.add_argument("--cycle", type=int, default=900)
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--first", type=int, default=1)
    asked = parser.parse_args()
    found: Counter[float] = Counter()
    with tempfile.TemporaryDirectory() as box:
        config = configuration(Path(box), PROTOCOLS[asked.protocol].config)
        counting = Injector(asked.cycle, NEVER)
        while run(config, counting) is None:
            counting = Injector(asked.cycle, NEVER)
        print(f"{asked.protocol}: a cycle runs {counting.lines} lines of wamctl", flush=True)
        wrong = 0
        for line in range(asked.first, counting.lines + 1, asked.every):
            injector = Injector(asked.cycle, line)
            seen = run(config, injector)
            if seen is None or not injector.where:
                found[-1.0] += 1
                continue
            periods, last = periods_of_torque(seen, injector.at_ns), seen.spans[-1]
            found[round(periods, 1)] += 1
            if periods > 2.0 or any(last.torques) or last.enabled:
                wrong += 1
                print(f"line {line}, {injector.where}: {periods:.1f} periods", flush=True)
    print(f"periods of torque, and how often: {dict(sorted(found.items()))}")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
