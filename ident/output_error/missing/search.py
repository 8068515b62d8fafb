"""The search: a servo model without effects, then effects one after the other, joint by joint."""

from dataclasses import dataclass, replace

from ident.output_error.missing.kinds import KIND_OF, KINDS
from ident.output_error.missing.nulls import Nulls, nulls
from ident.output_error.prepared import Prepared
from ident.output_error.search.parts import ENCODER_OFFSET, SERVO_PARTS, ZEROS, Part
from ident.output_error.search.rounds import extended, of_servos
from ident.output_error.search.selection import Accepted, Selection, possible
from ident.output_error.search.settings import SearchSettings
from ident.output_error.search.trial import Places
from ident.regression.progress import Tell


@dataclass(frozen=True)
class Search:
    """What a search ends with.

    Attributes:
        base: the arm without effects.
        end: with all accepted effects.
        nulls: of the effect-free simulations.
        asked: joints at which each effect was looked for.
    """

    base: Selection
    end: Selection
    nulls: Nulls
    asked: dict[Part, Places]

    @property
    def effects(self) -> tuple[Accepted, ...]:
        """What was accepted, but for the servo's own parts."""
        return tuple(a for a in self.end.accepted if a.part in KIND_OF)

    def least(self, part: Part, settings: SearchSettings) -> float:
        """Nats per sample that an effect has to bring."""
        return max(settings.least_gain, settings.null_factor * self.nulls.gain[part])


def search(begun: Prepared, base: Selection, settings: SearchSettings, tell: Tell) -> Search:
    """Effects that motions ask for that were left out.

    What the arm's file fixes is known. What it lists among the servo's parts, and a zero, is a part
    of the servo model: the file says that it is there.

    Args:
        begun: arm and recordings.
        base: the arm with what every joint has.
        settings: numbers that decide.
        tell: hears what is being done.
    """
    named = begun.arm.servo.parts
    servo = [p for p in SERVO_PARTS if not named or p.name in named]
    effects = [kind.part for kind in KINDS]
    if ZEROS.name in named:
        servo.append(ZEROS)
        effects.remove(ENCODER_OFFSET)
    asked = {p: places for p in effects if (places := possible(p, begun)).any()}
    base = of_servos(base, begun, servo, settings, tell)
    tell("simulating the arm without effects")
    args = begun.prior, asked, settings
    found = Search(base, base, nulls(base.setup, base.fit, *args), asked)
    least = {p: found.least(p, settings) for p in asked}
    known = replace(base, floor=found.nulls.typical)
    end = extended(known, begun, [*servo, *asked], least, settings, tell)
    return Search(base, end, found.nulls, asked)
