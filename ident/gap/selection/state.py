"""State of a search: data, current model, accepted effects, excluded transients."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from ident.effects.candidate import Candidate
from ident.effects.catalogue import catalogue
from ident.gap.regression.current_model import CurrentFit, extend
from ident.gap.regression.rows import WindowedRows
from ident.gap.selection.scoring import Score
from ident.gap.selection.thresholds import Threshold
from ident.gap.transients.detect import Transient
from ident.signals.arrays import Array

Place = tuple[str, tuple[int, ...]]
"""An effect and its joints."""


@dataclass(frozen=True)
class AcceptedEffect:
    """An effect that was accepted into the model.

    Attributes:
        score: with its nonlinear parameters refined.
        joints: main joints, which carry its gain, from 0.
        explained: squared residual that it removed per joint [N^2 m^2], shape (n,).
        held_out: gain on each fold, fitted on the others [nats per sample].
        rivals: other effects that cannot be told from it.
        next_best: best other effect at the same joints, or None.
        forms: its other forms that explain nearly as much, refined.
        near_forms: those whose residual is no more than some times as large.
    """

    score: Score
    joints: tuple[int, ...]
    explained: Array
    held_out: tuple[float, ...]
    rivals: tuple[Score, ...] = ()
    next_best: Score | None = None
    forms: tuple[Score, ...] = ()
    near_forms: tuple[Score, ...] = ()

    @property
    def candidate(self) -> Candidate:
        """The effect at its place, in its final form: what its first one leaves is not news."""
        h = self.score.candidate
        return catalogue()[h.effect].final_form(h)

    @property
    def place(self) -> Place:
        """The effect's id and its joints."""
        return self.candidate.effect, self.candidate.joints


@dataclass(frozen=True)
class SelectionState:
    """How far a search has come. Each step returns the next state.

    Attributes:
        rows: all rows, those inside transients marked as excluded.
        current: the model with all accepted effects.
        threshold: gain that an effect must reach.
        noise: pure error of each joint while it slides [N m], shape (n,); None without repeats.
        accepted: effects, in the order of acceptance.
        transients: excluded ones, in order of time.
        may_exclude: whether transients may be excluded.
        dropped: places that turned out insignificant and are not tried again.
        scores: of all candidates, round by round.
        calibrations: number of calibrations of the threshold.
    """

    rows: WindowedRows
    current: CurrentFit
    threshold: Threshold
    noise: Array | None
    accepted: tuple[AcceptedEffect, ...] = ()
    transients: tuple[Transient, ...] = ()
    may_exclude: bool = True
    dropped: frozenset[Place] = frozenset()
    scores: tuple[tuple[Score, ...], ...] = ()
    calibrations: int = 0

    def is_full(self, max_effects: int) -> bool:
        """Whether the search ends here: enough effects, or twice as many rounds."""
        names = {a.candidate.effect for a in self.accepted}
        return len(names) >= max_effects or len(self.scores) >= 2 * max_effects

    def reached_by(self, effect: AcceptedEffect) -> bool:
        """Whether the gain of an effect reaches its threshold."""
        return effect.score.gain >= self.threshold.of(effect.candidate.effect)

    def with_current(self, current: CurrentFit) -> "SelectionState":
        """The state with another current model."""
        return replace(self, current=current)

    def with_dropped(self, places: Iterable[Place]) -> "SelectionState":
        """The state in which some places are not tried again."""
        return replace(self, dropped=self.dropped | set(places))

    def with_more(self, effects: Sequence[AcceptedEffect]) -> CurrentFit:
        """The model with more effects."""
        return extend(self.rows, self.current, [a.candidate for a in effects])

    def with_only(self, effects: Sequence[AcceptedEffect]) -> "SelectionState":
        """The state with just these of the accepted effects."""
        none = replace(self.current, accepted=())
        current = extend(self.rows, none, [a.candidate for a in effects])
        return replace(self, current=current, accepted=tuple(effects))
