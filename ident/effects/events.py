"""What a search may report beside effects: events in time, and faults of the recording."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Event:
    """Something that is named in the result, and is no part of a model.

    Attributes:
        id: name in the result file.
        title: in plain words.
        equation: in the result file.
        signature: what it looks like in the residual.
        experiment: what to do next.
    """

    id: str
    title: str
    equation: str
    signature: str
    experiment: str


CONTACT = Event(
    id="contact",
    title="a push or a contact during a stretch of time",
    equation="tau_j += f_j for t1 <= t < t2",
    signature="in one stretch of time only, and not again when the motion is repeated",
    experiment="repeat the run with nothing and nobody near the arm",
)
"""An external torque between two times (Haddadin, De Luca, Albu-Schaeffer 2017, section IV)."""

DROPPED_SAMPLES = Event(
    id="dropped_samples",
    title="lost, repeated or shifted samples in the log",
    equation="q(t_k) stands in the log with another stamp",
    signature="short spikes in the acceleration of all joints at once",
    experiment="record again with a logger that keeps up; compare its counters",
)

EVENTS = {event.id: event for event in (CONTACT, DROPPED_SAMPLES)}
