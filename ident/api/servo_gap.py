"""The search for missing effects from positions alone, on recordings in memory."""

from collections.abc import Sequence

from ident.api.arm import Arm
from ident.api.commanded import commanded
from ident.api.named import NamedEffects
from ident.api.recording import Recording
from ident.output_error.missing.settings import GapBySimulation
from ident.output_error.servo_model import ServoModel
from ident.regression.progress import Tell
from ident.workflows.output_error.gap import GapOfServos, gap_of_servos


class ServoGap(NamedEffects[GapOfServos]):
    """Where the simulated positions of an arm with servos differ from the measured ones, and why.

    Attributes:
        run: the search with all its figures.
    """

    @property
    def model(self) -> ServoModel:
        """The arm with the effects added."""
        return self.run.model


def servo_gap(arm: Arm, recordings: Sequence[Recording], null_runs: int, tell: Tell) -> ServoGap:
    """What a model of the arm with its servos misses, by name.

    Args:
        arm: the arm.
        recordings: of commands and positions.
        null_runs: effect-free simulations behind the thresholds.
        tell: hears what is being done.

    Raises:
        DataError: recordings from which nothing can be learned.
    """
    known, segments = commanded(arm, recordings)
    options = GapBySimulation(null_runs=null_runs)
    return ServoGap(gap_of_servos(known, segments, options, tell))
