"""What a search by simulation found, as Python sees it."""

from ident.api.named import NamedEffects
from ident.output_error.servo_model import ServoModel
from ident.workflows.output_error.gap import GapOfServos


class ServoGap(NamedEffects[GapOfServos]):
    """Where the simulated positions of an arm with servos differ from the measured ones, and why.

    Attributes:
        run: the search with all its figures.
    """

    @property
    def model(self) -> ServoModel:
        """The arm with the effects added."""
        return self.run.model
