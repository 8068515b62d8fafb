"""What the arm is doing."""

from enum import IntEnum


class Phase(IntEnum):
    """Phases of the experiment; `BRAKE` and `CUT_OFF` end it early, `TEST` comes behind `ENABLE`.

    `IDLE` comes before the first phase, and is the only one of `wamctl bench`.
    """

    IDLE = 0
    ENABLE = 1
    APPROACH = 2
    EXCITE = 3
    RETURN = 4
    RELEASE = 5
    DISABLE = 6
    BRAKE = 7
    CUT_OFF = 8
    TEST = 9

    @property
    def word(self) -> str:
        """The phase in lower case, for sentences."""
        return self.name.lower().replace("_", " ")
