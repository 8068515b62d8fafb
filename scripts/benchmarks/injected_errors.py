# ruff: noqa: SLF001 - it puts itself between the loop and its cycle
"""A bug at any line of a cycle: how long does torque of before act on the arm?

Usage: scripts/benchmarks/injected_errors.py PROTOCOL [--every K] [--phases PHASE...]

PROTOCOL is canopen or puck; from the root, with .venv's Python. An experiment runs in lockstep, in
one process. In the middle of each phase it is forked for every K-th line of `wamctl` that the cycle
runs, which then raises an exception that nobody expects. What counts is what the simulated drives
make of it: for how many periods after the cycle's start a torque other than zero still acts, and
whether all drives are off in the end. In `excite`, it is a cycle that tells the log the drives'
states as well. In `brake`, it is the tenth cycle after the operator's stop.
"""

import argparse
import os
import sys
import tempfile
from collections import Counter
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import Any

from fault_matrix import PROTOCOLS, configuration
from fault_verdict import PERIOD_NS
from fault_witness import Span, Witness
from one_process import Branches, set_up

from sim_bus.assembly import load_simulation
from wamctl.arm.errors import UserError
from wamctl.experiment.loop import Loop
from wamctl.experiment.preflight import Prepared, prepare
from wamctl.telemetry.status import Phase

ROOT = str(Path(__file__).parents[2] / "wamctl")
PHASES = {  # the cycle in which the bug is, counted from the phase's first
    Phase.ENABLE: 3,
    Phase.TEST: 900,
    Phase.APPROACH: 400,
    Phase.EXCITE: 400,
    Phase.RETURN: 400,
    Phase.RELEASE: 200,
    Phase.BRAKE: 10,
}


class InjectedError(Exception):
    """A bug that nobody expects."""


class Tracer:
    """Counts the lines of `wamctl` that a cycle runs, and raises at one of them.

    Attributes:
        lines: how many it has run.
        where: the line that was hit; empty if none was.
    """

    def __init__(self, line: int) -> None:
        self.lines, self.where = 0, ""
        self._line = line

    def on_call(self, frame: FrameType, event: str, argument: object) -> Any:
        """For `sys.settrace`."""
        return self._on_line if frame.f_code.co_filename.startswith(ROOT) else None

    def _on_line(self, frame: FrameType, event: str, argument: object) -> Any:
        if event == "line":
            self.lines += 1
            if self.lines == self._line:
                name = Path(frame.f_code.co_filename).relative_to(ROOT)
                self.where = f"{name}:{frame.f_lineno}"
                raise InjectedError
        return self._on_line


def injected(
    prepared: Prepared, config: Path, phase: Phase, every: int
) -> tuple[int, list[tuple[str, float, Span]]]:
    """Lines of a cycle of a phase; and for each that was hit: where, periods of torque, the end."""
    simulation = load_simulation(config, 0)
    simulation.arm.plant.warm_up()
    witness = Witness(simulation.arm, simulation)
    tracer, start_ns, seen, whole, lines = Tracer(-1), 0, Counter(), Loop._cycle, 0
    with Branches() as cases, set_up(prepared, config, simulation, witness) as rig:

        def cycle(loop: Loop, *arguments: Any) -> Any:
            nonlocal tracer, start_ns, lines
            seen[loop.phase] += 1
            is_due = loop.phase is phase and seen[phase] >= PHASES[phase] and not lines
            tells = loop.timing.cycles % loop._status_cycles == 0
            if not is_due or cases.is_case or (phase is Phase.EXCITE and not tells):
                return whole(loop, *arguments)
            start_ns = simulation_ns(witness)
            if cases.branch("lines"):
                sys.settrace(tracer.on_call)
                whole(loop, *arguments)
                sys.settrace(None)
                cases.end(tracer.lines)
            lines = cases.results.pop()[1]
            for line in range(1, lines + 1, every):
                if cases.branch(line):
                    tracer = Tracer(line)
                    sys.settrace(tracer.on_call)
                    try:
                        return whole(loop, *arguments)
                    finally:
                        sys.settrace(None)
            return whole(loop, *arguments)

        if phase is Phase.BRAKE:
            rig.loop._operator = lambda: "a key" if seen[Phase.EXCITE] > 400 else None
        Loop._cycle = cycle
        try:
            with suppress(UserError, InjectedError):
                rig.run()
        finally:
            Loop._cycle = whole
        witness.stay_alone()
        cases.end((tracer.where, periods_of_torque(witness.spans, start_ns), witness.spans[-1]))
    return lines, [result for _, result in cases.results]


def simulation_ns(witness: Witness) -> int:
    """Time up to which the arm has moved [ns]."""
    return witness.spans[-1].until_ns


def periods_of_torque(spans: list[Span], start_ns: int) -> float:
    """For how many periods after a cycle's start any torque still acted."""
    torque = [s.until_ns for s in spans if s.until_ns > start_ns and any(s.torques)]
    return (max(torque) - start_ns) / PERIOD_NS if torque else 0.0


def main() -> int:
    """The distribution, and every line beyond two periods."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("protocol", choices=PROTOCOLS)
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--phases", nargs="*", default=[phase.word for phase in PHASES])
    asked, wrong = parser.parse_args(), 0
    with tempfile.TemporaryDirectory() as box:
        config = configuration(Path(box), PROTOCOLS[asked.protocol].config)
        prepared = prepare(config)
        for phase in (p for p in PHASES if p.word in asked.phases):
            lines, found = injected(prepared, config, phase, asked.every)
            for where, periods, last in found:
                if periods > 2.0 or any(last.torques) or last.enabled:
                    wrong += 1
                    print(f"{phase.word}, {where}: {periods:.1f} periods", flush=True)
            periods = dict(sorted(Counter(round(p, 1) for _, p, _ in found).items()))
            print(
                f"{asked.protocol} {phase.word}: {len(found)} of {lines} lines; periods of torque, "
                f"and how often: {periods}; {sum(os.times()[:4]):.0f} s of a core so far",
                flush=True,
            )
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
