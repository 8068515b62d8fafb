"""The settings of `ident gap` that concern the recordings themselves: long logs, faulty samples."""

from ident.model.setting_fields import Section, count, positive, share


class LongLogs(Section):
    """Long logs are searched by stretches, so that memory does not grow with their length."""

    most_s: float = positive(150.0, "Longest log that is searched whole [s]: 7 periods of 20 s.")
    stretch_s: float = positive(40.0, "Length of a longer one's stretch [s]: two such periods.")
    count: int = count(3, "Stretches of all logs together [1]: one for each fold.")


class BrokenTime(Section):
    """Steps at which stamps and motion disagree, see `data/broken_time.py`."""

    usual_share: float = share(
        0.99, "Quantile of the steps' distances from their neighbours' that is the usual one [1]."
    )
    far: float = positive(12.0, "Times the usual distance from which a step is broken [1].")
    least_steps: float = positive(
        0.5, "Steps by which all joints must be ahead or behind [1]: one where a sample is lost."
    )
    apart: float = share(
        0.3, "Of their distance that joints may be apart from one common time [1]: impacts are."
    )
    least_kept: float = share(
        0.6, "Of a recording that must be left once the broken steps are cut out [1]."
    )
