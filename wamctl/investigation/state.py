"""What an investigation knows, on disk after every step."""

import json
import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from wamctl.arm.configuration.known_change import known_change
from wamctl.arm.errors import DataError, writing
from wamctl.errors import UsageError
from wamctl.investigation.budget import Cost

FILE = "state.json"
NAMED, NO_GAP, AMBIGUOUS, UNKNOWN = "named", "no_gap", "ambiguous", "unknown"
_VERSION = 1
_UNFINISHED = ".unfinished-"


@dataclass(frozen=True)
class Request:
    """What was asked for; an investigation goes on only with the same.

    Attributes:
        config: the arm's file.
        bus: `sim`, or INTERFACE:CHANNEL.
        lockstep: simulated time.
        hidden: what the simulated arm hides.
        seed: of the simulated arm.
        trajectory: the first motion; None: the configuration's.
    """

    config: str
    bus: str
    lockstep: bool
    hidden: str | None
    seed: int
    trajectory: str | None


@dataclass(frozen=True)
class Round:
    """A round that is over.

    Attributes:
        reason: why this motion.
        motion: its name; empty for the first.
        folder: of its files, beside the state.
        cost: of its runs.
        leader: the answer that led before it; empty for the first.
        asked: evidence that would have confirmed it [nats].
        evidence: of the leader over each rival so far [nats].
        bets: log-likelihood of the leader less that of a rival in this round's blocks, by rival
            [nats].
        closed: share of a rival's squared error in them that the leader does not make, by rival, at
            the joint at which they differ most.
        verdict: of `ident gap` on all logs.
        answer: its effects with their joints, such as `stribeck:4`; empty for none.
        odds: of each answer.
        stopped: how a limit ended the motion; None: it did not.
        changed: what the operator had done to the arm before it, in his words; empty: nothing.
        suspected: effects that help prediction, but are too small or unsure for `ident gap`.
        unexplained: whether `ident gap` sees structure that no effect explains.
        rivals: answers that `ident gap` cannot tell from its own.
        lookalikes: written-down answers with an effect that looks like the leader's.
        unsettled: written-down answers that no prediction can confirm: another form of theirs is
            open, or no freer answer stood beside them.
    """

    reason: str
    motion: str
    folder: str
    cost: Cost
    leader: str
    asked: float = 0.0
    evidence: dict[str, float] = field(default_factory=dict)
    bets: dict[str, list[float]] = field(default_factory=dict)
    closed: dict[str, float] = field(default_factory=dict)
    verdict: str = ""
    answer: str = ""
    odds: dict[str, float] = field(default_factory=dict)
    stopped: str | None = None
    changed: str = ""
    suspected: Sequence[str] = ()
    unexplained: bool = False
    rivals: Sequence[str] = ()
    lookalikes: Sequence[str] = ()
    unsettled: Sequence[str] = ()

    @property
    def is_suspicion(self) -> bool:
        """Whether nothing is named, and what is suspected may be all there is."""
        whole = self.verdict == UNKNOWN and not self.answer and not self.unexplained
        return self.verdict == NO_GAP or (whole and bool(self.suspected))

    @property
    def is_altered(self) -> bool:
        """Whether its log is that of another arm, which no fit may use."""
        return bool(self.changed) and known_change(self.changed).alters_the_model


@dataclass(frozen=True)
class State:
    """An investigation.

    Attributes:
        request: what was asked for.
        rounds: those that are over.
        wall_s: time that all sessions have taken [s].
        pending: what the operator has done to the arm for the next round; empty: nothing.
    """

    request: Request
    rounds: tuple[Round, ...] = ()
    wall_s: float = 0.0
    pending: str = ""

    @property
    def motions(self) -> int:
        """Motions after the first that were chosen without the operator's help."""
        return len([r for r in self.rounds if not r.changed]) - 1

    @property
    def answers(self) -> int:
        """How often the operator has answered."""
        return len([r for r in self.rounds if r.changed]) + bool(self.pending)

    @property
    def asked_for_gap(self) -> list[Round]:
        """The rounds on whose logs `ident gap` was asked."""
        return [r for r in self.rounds if r.verdict and not r.is_altered]

    @property
    def cost(self) -> Cost:
        """Of all rounds."""
        total = Cost()
        for item in self.rounds:
            total = total.plus(item.cost)
        return total

    @property
    def leaders(self) -> tuple[str, ...]:
        """Answers that have led, each once, in order."""
        return tuple(dict.fromkeys(r.leader for r in self.rounds if r.leader))


def begun(out: Path, request: Request, resume: bool) -> State:
    """The state to begin with: none, or that of an earlier session.

    Raises:
        UsageError: an investigation is there and is not to be resumed, or asked for something else.
        DataError: its state cannot be read.
    """
    path = out / FILE
    for left in out.glob(f"rounds/*/{_UNFINISHED}*"):
        shutil.rmtree(left, ignore_errors=True)
    if not path.exists():
        out.mkdir(parents=True, exist_ok=True)
        return State(request)
    if not resume:
        raise UsageError(
            f"{out} holds an investigation already: go on with --resume, or name another --out."
        )
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        known = Request(**content["request"])
        rounds = tuple(Round(**r | {"cost": Cost(**r["cost"])}) for r in content["rounds"])
        pending = str(content.get("pending", ""))
        state = State(known, rounds, float(content["wall_s"]), pending)
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise DataError(
            f"{path} cannot be read ({error!r}): begin again in another --out."
        ) from error
    if known != request:
        pairs = zip(asdict(known).items(), asdict(request).values(), strict=True)
        other = [f"{name} {old!r}, not {new!r}" for (name, old), new in pairs if old != new]
        raise UsageError(f"{out} was begun with {', '.join(other)}: resume it with the same.")
    return state


def keep(out: Path, state: State) -> None:
    """Write the state; what is on disk is whole at any time.

    Raises:
        DataError: it cannot be written.
    """
    write_whole(out / FILE, json.dumps({"version": _VERSION} | asdict(state), indent=2))


def write_whole(path: Path, text: str) -> None:
    """Write a file so that either the old or the new one is there, whole.

    Raises:
        DataError: it cannot be written.
    """
    unfinished = path.with_name(f".{path.name}.unfinished")
    with writing(path):
        with unfinished.open("w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        unfinished.replace(path)


def made(path: Path, make: Callable[[Path], None]) -> Path:
    """A file or folder that is there once it is whole; made only if it is not there.

    Args:
        path: where it will be.
        make: makes it at another place.
    """
    if not path.exists():
        with _beside(path) as unfinished:
            make(unfinished)
            unfinished.replace(path)
    return path


@contextmanager
def _beside(path: Path) -> Iterator[Path]:
    path.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=_UNFINISHED, dir=path.parent) as folder:
        yield Path(folder) / path.name
