"""The rival answers to a gap, each fitted to all logs and kept as a model."""

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ident.checks.examine import examine
from ident.effects.bound_effects import load_model, members_of
from ident.effects.candidate import Candidate, Value
from ident.effects.catalogue import catalogue
from ident.excitation.target_effect import read_gap
from ident.gap.data.experiment import Experiment, facts_of
from ident.gap.options import Options
from ident.gap.regression.current_model import CurrentFit, extend, nominal_fit
from ident.gap.regression.feasible_fit import feasible_fit
from ident.gap.regression.rows import WindowedRows
from ident.gap.results.full_model import model_with
from ident.gap.search import rows_of
from ident.gap.selection.candidates import all_candidates
from ident.gap.selection.candidates import examine as scored
from ident.gap.selection.estimates import final_estimates
from ident.gap.selection.refinement import refine_nonlinear_parameters
from ident.gap.selection.scoring import Score
from ident.model.identified_model import Model
from ident.planning.curves import best_curve, curves, with_curves
from ident.planning.known import Known, known_of
from ident.planning.noise import Noise, noise_of

_BETWEEN = 3**0.5
"""A value lies anywhere between those of two forms: standard deviations of that (JCGM 100:2008)."""

Tell = Callable[[str], None]

NONE, UNKNOWN = "none", "unknown"

_RIVALS = 3
"""So many other answers are fitted, beside those that `ident gap` names."""

_SHARE = 0.3
"""Of the leader's gain: what explains less is no rival."""


@dataclass(frozen=True)
class Hypothesis:
    """A possible answer.

    Attributes:
        name: `none`, `unknown`, or effects with their joints from 1, such as `stribeck:4`.
        model: the arm with it, fitted to all logs.
        known: what all logs tell of its numbers.
        noise: what it leaves of the torque.
        size: number of coefficients of its effects.
        estimates: of the parameters of its effects, by name.
        resembles: effects of the catalogue that come nearest to a measured curve.
        has_open_form: in another form that the logs allow as well, one of its effects might be
            none.
    """

    name: str
    model: Model
    known: Known
    noise: Noise
    size: int = 0
    estimates: tuple[Mapping[str, Value], ...] = ()
    resembles: tuple[str, ...] = ()
    has_open_form: bool = False


@dataclass(frozen=True)
class Answer:
    """What `ident gap` has answered.

    Attributes:
        content: of `gap.json`.
        accepted: its effects, with their shapes; what its model holds without a name is left out.
    """

    content: dict[str, Any]
    accepted: tuple[Candidate, ...]

    @property
    def rivals(self) -> list[tuple[str, tuple[int, ...]]]:
        """Effects and joints (from 0) that it cannot tell from its own, or only suspects."""
        effects, suspected = self.content["effects"], self.content.get("suspected", [])
        named = [r for e in effects for r in e["rivals"]] + [*suspected]
        return [(r["name"], tuple(j - 1 for j in r["joints"])) for r in named]


def read_answer(folder: Path) -> Answer:
    """The answer of a folder of `ident gap`.

    Raises:
        DataError: there is none.
    """
    content = read_gap(folder / "gap.json", "effects", "verdict")
    named = {(e["name"], tuple(j - 1 for j in e["joints"])) for e in content["effects"]}
    members = members_of(load_model(folder / "model.yaml"))
    return Answer(content, tuple(c for c, _ in members if _place(c) in named))


def hypotheses(
    source: Experiment, answer: Answer, options: Options, tell: Tell, lead: str | None = None
) -> list[Hypothesis]:
    """The leading answer first, then its rivals.

    An effect of another form than the catalogue's may be explained best by one of the catalogue. So
    there is a measured curve among the rivals, in the place of the leading effect: what has the
    catalogue's form is predicted as well without the freedom of the curve.

    Args:
        source: all recordings so far.
        answer: what `ident gap` says of them.
        options: of its search.
        tell: is told the progress.
        lead: answer that leads where it is one of the rivals; None: what `ident gap` says.

    Raises:
        DataError: recordings of which nothing may be said.
    """
    source = replace(source, datasets=examine(source.arm, source.datasets).data)
    work = _Work(source, options)
    tell("fitting the model without effects")
    nominal = nominal_fit(work.rows, facts_of(source))
    leader = nominal if not answer.accepted else extend(work.rows, nominal, answer.accepted)
    tell("scanning the catalogue for rivals")
    tried = {name_of(leader.accepted): leader, NONE: nominal}
    for rival in _rivals(work, nominal, leader, answer):
        tried.setdefault(name_of(rival.accepted), rival)
    tell("measuring the curve of what has no name")
    curve = _measured(work, leader, answer)
    ordered = [tried[n] for n in sorted(tried, key=lambda n: n != lead)]  # a stable sort
    freer = _freer(work, nominal, ordered) if curve is None else None
    found = []
    if curve is not None:
        near = _nearest(work, leader, curve.accepted[-1].joints[0])
        found.append(replace(work.hypothesis(UNKNOWN, curve), resembles=near))
    for name, current in tried.items():
        tell(f"fitting {name}")
        found.append(work.hypothesis(name, current))
    if freer is not None:
        near = _at(freer.accepted[-1].joints[0], tried.values())
        found.append(replace(work.hypothesis(UNKNOWN, freer), resembles=near))
    return found


def name_of(effects: Sequence[Candidate]) -> str:
    """Effects and their joints in one word."""
    parts = [f"{c.effect}:{'-'.join(str(j + 1) for j in c.joints)}" for c in effects]
    return "+".join(sorted(parts)) or NONE


def in_its_place(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The leader, and the answers that may be true in its place; all where no effect leads.

    Torque is measured joint by joint: an effect at joints whose torque the leader's do not change,
    and that share no motor with them, may be true beside it.
    """
    leader, *rivals = found
    own = _changed(leader)
    kept = [h for h in rivals if not own or not _changed(h) or own & _changed(h)]
    return [leader, *kept]


def _changed(answer: Hypothesis) -> set[int]:
    """Joints (from 1) whose torque an answer's effects change, or that share a motor with them."""
    rows = {j for r in answer.model.effects.records for j in r.rows}
    motors = answer.noise.motors
    if motors is None:
        return rows
    turned = motors[:, [j - 1 for j in sorted(rows)]].any(axis=1)
    return rows | {int(j) + 1 for j in np.flatnonzero(motors[turned].any(axis=0))}


def unsettled(found: Sequence[Hypothesis]) -> list[str]:
    """Answers that no prediction can confirm: their form is open, or no freer answer is there.

    A measured curve at a joint is freer than the answers with an effect there.
    """
    curve = next((h for h in found if h.name == UNKNOWN), None)
    at = {j for h in [curve] if h is not None for j in h.model.effects.records[-1].rows}
    joints = {h.name: {j for r in h.model.effects.records for j in r.joints} for h in found}
    others = [n for n, own in joints.items() if at and own and not own & at]
    return list(dict.fromkeys([*(h.name for h in found if h.has_open_form), *others]))


def lookalikes(answer: Hypothesis, found: Sequence[Hypothesis]) -> list[str]:
    """Answers with another effect that, as the catalogue says, looks like one of this one's."""
    return [h.name for h in found if h is not answer and _looks_like(answer, h)]


def _looks_like(answer: Hypothesis, other: Hypothesis) -> bool:
    pairs = itertools.product(answer.model.effects.records, other.model.effects.records)
    return any(
        set(a.joints) & set(b.joints)
        and (b.name in catalogue()[a.name].rivals or a.name in catalogue()[b.name].rivals)
        for a, b in pairs
    )


class _Work:
    """Recordings as rows, and models fitted to them."""

    def __init__(self, source: Experiment, options: Options) -> None:
        self.source, self.options = source, options
        self.rows: WindowedRows = rows_of(source, options)

    def hypothesis(self, name: str, current: CurrentFit) -> Hypothesis:
        """The physically possible arm of a fit, on all data."""
        final = final_estimates(self.rows, current, self.options.settings.significance)
        base_size = len(self.rows.base_parameters)
        possible = feasible_fit(self.source, final.fit, base_size, near_cad=True)
        model = model_with(self.source, possible, final.fit, final.effects)
        size = sum(len(h.coefficients) for h in final.effects)
        known = known_of(self.rows, current.model, final.effects, final.fit)
        noise = noise_of(current, self.rows.windows)
        is_open = any(self._is_open(current, i) for i in range(len(current.accepted)))
        return Hypothesis(name, model, known, noise, size, final.parameters, (), is_open)

    def _is_open(self, current: CurrentFit, index: int) -> bool:
        """Whether an effect's defining coefficient may be none in its other form.

        A form with a further term explains no less. Where that takes over, what predicts well may
        be the other form: a spring that hardens only, beside links that are heavier.
        """
        own, values = current.accepted[index], current.fit.effects[index]
        form = catalogue()[own.effect].alternative_form(own, values)
        if form is None or len(form.coefficients) == len(own.coefficients):
            return False
        others = [form if i == index else e for i, e in enumerate(current.accepted)]
        bare = replace(current, accepted=())
        again = extend(self.rows, bare, others).fit.effects[index]
        pairs = zip(own.coefficients, values, again, strict=False)
        z = self.options.settings.naming.z
        return any(c.defining and z * abs(new - old) > _BETWEEN * abs(old) for c, old, new in pairs)

    def scores(self, current: CurrentFit, candidates: Sequence[Candidate]) -> list[Score]:
        """Candidates beside a model, best first."""
        return scored(self.rows, current, candidates, self.options.settings.scoring)[1]

    def refined(self, current: CurrentFit, score: Score) -> CurrentFit:
        """A model with a candidate in its best shape."""
        settings = self.options.settings.scoring
        best = refine_nonlinear_parameters(self.rows, current, score, settings)[0]
        return extend(self.rows, current, [best.candidate])


def _rivals(
    work: _Work, nominal: CurrentFit, leader: CurrentFit, answer: Answer
) -> Iterator[CurrentFit]:
    """The leader without each of its effects, and with another in the place of the last.

    Without effects, or without a verdict, rivals are what explains most beside the nominal model.
    """
    for left_out in leader.accepted if len(leader.accepted) > 1 else ():
        yield extend(work.rows, nominal, [c for c in leader.accepted if c is not left_out])
    last = leader.accepted[-1:]
    others = leader.accepted[:-1]
    base = extend(work.rows, nominal, others) if others else nominal
    candidates = all_candidates(base.model.facts)
    scores = work.scores(base, candidates)
    most = max((s.gain for s in scores if _place(s.candidate) in map(_place, last)), default=0.0)
    chosen: dict[tuple[str, tuple[int, ...]], Score] = {}
    for score in scores:
        place = _place(score.candidate)
        asked = place in answer.rivals or score.gain > _SHARE * most
        if asked and place not in map(_place, last) and len(chosen) < _RIVALS:
            chosen.setdefault(place, score)
    for score in chosen.values():
        yield work.refined(base, score)


def _place(candidate: Candidate) -> tuple[str, tuple[int, ...]]:
    return candidate.effect, candidate.joints


def _measured(work: _Work, leader: CurrentFit, answer: Answer) -> CurrentFit | None:
    """The leader with the curves that explain most of what it leaves at the gap's worst joint."""
    left = answer.content.get("unexplained") or []
    if answer.content["verdict"] != UNKNOWN or not left:
        return None
    joint = max(left, key=lambda u: u["unexplained"] or 0.0)["joint"] - 1
    return with_curves(work.rows, leader, joint, work.options.settings)


def _freer(work: _Work, nominal: CurrentFit, tried: Sequence[CurrentFit]) -> CurrentFit | None:
    """The leader with a curve in the place of one of its effects: of any form, where that has one.

    The curve that explains most beside the others. Where nothing leads, it is in the place of that
    of the rivals. None: no curve explains anything.
    """
    named = [t for t in tried if t.accepted]
    leading = named[:1] if tried[0].accepted else named
    best: tuple[float, CurrentFit, Candidate] | None = None
    done = set[tuple[tuple[Candidate, ...], int]]()
    for current, effect in ((t, e) for t in leading for e in t.accepted):
        others = tuple(e for e in current.accepted if e is not effect)
        joints = [j for j in effect.joints if (others, j) not in done]
        done |= {(others, j) for j in joints}
        base = extend(work.rows, nominal, others) if others else nominal
        beside = base.fit.gain_over(nominal.fit)
        over = [c for j in joints for c in curves(work.rows, j)]
        score = best_curve(work.rows, base, over, work.options.settings)
        gain = beside + (0.0 if score is None else score.penalised_gain)
        if score is not None and (best is None or gain > best[0]):
            best = gain, base, score.candidate
    return None if best is None else extend(work.rows, best[1], [best[2]])


def _at(joint: int, tried: Iterable[CurrentFit]) -> tuple[str, ...]:
    """Effects that were tried at a joint (from 0)."""
    effects = (e.effect for t in tried for e in t.accepted if joint in e.joints)
    return tuple(dict.fromkeys(effects))


def _nearest(work: _Work, leader: CurrentFit, joint: int) -> tuple[str, ...]:
    """Effects of the catalogue that explain most at a joint (from 0), best first."""
    at = [c for c in all_candidates(leader.model.facts) if joint in c.joints]
    names = dict.fromkeys(s.candidate.effect for s in work.scores(leader, at))
    return tuple(names)[:_RIVALS]
