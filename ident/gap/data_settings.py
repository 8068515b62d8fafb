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


class DataChecks(Section):
    """Faults of the data, looked for before any physics."""

    fast_steps: float = positive(
        12.0,
        "Position steps are judged where they are this many times the encoder's step or the usual"
        " prediction error [1]. Slower motion cannot show a lost sample.",
    )
    min_fault_share: float = share(
        2e-4, "Smallest share of skipped samples that is reported [1]. Rarer ones change no result."
    )
    min_repeated_share: float = share(
        2e-3,
        "The same for repeated samples [1]: the next reading makes up for each, so that little of"
        " it is left at the frequencies of the windows.",
    )
    min_fault_count: int = count(
        4, "Smallest number of faulty samples that is reported [1]. A few may be chance."
    )
    min_steps: int = count(8, "Fewest steps of a stretch that is judged [1]: two joints' motion.")
    step_quantile: float = share(
        0.02,
        "Quantile of the changes that are not zero which is the step of an encoder or of a recorded"
        " torque [1]: not the least, which a single glitch may make.",
    )
    jitter_steps: int = count(
        10, "Steps on both sides of a jump in which a clock that jitters makes up for it [1]."
    )
    repeated_step: float = share(
        0.05,
        "A step below this share of the expected one is a repeated sample [1]. The checks before"
        " the search mend those; longer ones are a clock's jitter.",
    )
    skipped_step: float = positive(
        1.75, "A step above this multiple of the expected one skips a sample [1]: near two."
    )
    min_way_gained: float = share(
        0.5,
        "Steps that the jumps of skipped samples must add to the way around them [1]: 1 where a"
        " sample is lost, 0 where the clock only jitters.",
    )
    clear_correlation: float = share(
        0.7, "Correlation of torque and CAD model from which sign and scale are judged [1]."
    )
    weak_correlation: float = share(
        0.3, "Correlation below which torque that drives friction has the wrong sign [1]."
    )
    dissipation_z: float = positive(
        4.0, "Standard errors by which the mean power must be negative for a wrong sign [1]."
    )
    correlated_rows: float = positive(
        40.0,
        "Rows at 20 Hz that count as one in that standard error [1]: power is correlated over 2 s.",
    )
    min_torque_scale: float = positive(
        0.25,
        "Smallest torque in units of the CAD model's [1]. CAD masses are no fourfold off.",
    )
    max_torque_scale: float = positive(
        4.0, "Largest torque in units of the CAD model's [1]. CAD masses are no fourfold off."
    )
