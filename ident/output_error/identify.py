"""Identification by simulation: from recordings to servos, gears, friction, and zeros."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.model.arm import Arm
from ident.output_error.changed_gains import ChangedGain, changed_gain
from ident.output_error.fit import Fit, fit
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.prepared import Prepared, prepared, searched
from ident.output_error.recordings import GLANCED_S
from ident.output_error.search.confirmation import confirmed, doubt, without_parts
from ident.output_error.search.exchanged import exchanged_joints
from ident.output_error.search.late_start import begun_with_delay, stamped_late
from ident.output_error.search.parts import PARTS, Part
from ident.output_error.search.rounds import extended, of_servos
from ident.output_error.search.selection import Accepted, Selection
from ident.output_error.search.settings import SearchSettings
from ident.output_error.servo_model import ServoModel
from ident.output_error.setup import MotionSegment, Setup
from ident.output_error.uncertainty import Knowledge, knowledge
from ident.regression.progress import Tell
from wamctl.arm.config import ServoSection
from wamctl.arm.errors import ConfigurationError

_LIMITS = ("torque_limit", "integral_limit", "profile_speed", "profile_acceleration")
_IDLE = 0.01  # encoder steps: a limit that moves no sample by more is not reached
_ROUNDS = 12


@dataclass(frozen=True)
class Found:
    """An identification by simulation.

    Attributes:
        model: the arm.
        setup: it, along all recordings.
        fit: of all recordings.
        search: which parts the recordings ask for.
        known: how well the settings are known.
        moving: which joints moved, shape (n,).
        early_s: how much earlier the commands should have been stamped [s]; 0: not at all.
        exchanged: two joints whose columns appear to be exchanged, from 0; None: none do.
        changed: a gain that is not the same in all recordings; None: all are.
    """

    model: ServoModel
    setup: Setup
    fit: Fit
    search: Selection
    known: Knowledge
    moving: NDArray[np.bool_]
    early_s: float
    exchanged: tuple[int, int] | None
    changed: ChangedGain | None


def identify_by_simulation(arm: Arm, segments: Sequence[MotionSegment], tell: Tell) -> Found:
    """Servos, gears, friction, and zeros of an arm.

    Args:
        arm: kinematics, links, and what its file says of the servos.
        segments: the recordings.
        tell: hears what is being done.

    Raises:
        DataError: no joint moves.
        ConfigurationError: the arm's file names parts or quantities that do not exist.
    """
    parts = _parts(arm.servo, arm.source)
    settings = SearchSettings()
    begun = prepared(arm, segments)
    begun, base = begun_with_delay(begun, searched(begun.setup, GLANCED_S), settings)
    search = selected(begun, base, parts, settings, tell)
    early = stamped_late(begun, base, search, settings)
    exchanged = exchanged_joints(begun, search, settings)
    best, known = _of_all(begun, search, tell)
    if vague := [a for a in search.accepted if is_vague(a, known, settings)]:
        search = without_parts(search, base.fit, vague, begun, settings)
        best, known = _of_all(begun, search, tell)
    tell("comparing the recordings")
    changed = changed_gain(begun, best, known, settings)
    model = model_of(begun, best, known)
    return Found(model, begun.setup, best, search, known, begun.moving, early, exchanged, changed)


def is_vague(accepted: Accepted, known: Knowledge, settings: SearchSettings) -> bool:
    """Whether an effect's size may be nothing, so that it need not be there in another motion."""
    if accepted.part.servo or accepted.of_all:
        return False
    row = ROW[accepted.part.quantities[0]]
    return bool(known.deviations[row, accepted.joint] < settings.sure_size)


def _of_all(begun: Prepared, search: Selection, tell: Tell) -> tuple[Fit, Knowledge]:
    """The arm fitted to all recordings, and how well it is known."""
    best = fit_of_all(begun, search.fit, tell)
    tell("how well it is known")
    return best, knowledge(begun.setup, best, begun.prior)


def selected(
    begun: Prepared,
    base: Selection,
    parts: Sequence[Part],
    settings: SearchSettings,
    tell: Tell,
) -> Selection:
    """The arm with the parts that its recordings ask for and cannot do without."""
    servo = [p for p in parts if p.servo]
    found = of_servos(base, begun, servo, settings, tell)
    found = extended(found, begun, parts, {}, settings, tell)
    asked = [a for a in found.accepted if not a.of_all]
    shown = confirmed(found, base.fit, asked, begun, settings)
    doubted = [a for a, how in zip(asked, shown, strict=True) if doubt(how, settings)]
    return without_parts(found, base.fit, doubted, begun, settings) if doubted else found


def fit_of_all(begun: Prepared, start: Fit, tell: Tell) -> Fit:
    """The same settings, fitted to all recordings; limits that these do not reach are taken out."""
    tell("fitting all recordings", 0.0)
    found = fit(
        begun.setup,
        start.settings,
        start.free,
        begun.prior,
        _ROUNDS,
        lambda k, rms: tell("fitting all recordings", min(k / _ROUNDS, 1.0)),
    )
    return _reached(begun, found)


def _reached(begun: Prepared, found: Fit) -> Fit:
    """The fit without limits that no sample comes to, whose values say nothing."""
    settings, free = found.settings.copy(), found.free.copy()
    for name in _LIMITS:
        row = ROW[name]
        for j in np.flatnonzero(free[row]):
            bare = settings.copy()
            bare[row, j] = QUANTITIES[row].first
            change = begun.setup.residuals(bare)[:, j] - found.residuals[:, j]
            if np.abs(change).max() <= _IDLE * begun.resolution[j]:
                settings, free[row, j] = bare, False
    return replace(found, settings=settings, free=free)


def model_of(begun: Prepared, best: Fit, know: Knowledge) -> ServoModel:
    """The arm with the settings of a fit."""
    names = tuple(dict.fromkeys(s.name for s in begun.setup.segments))
    at_link, robot = begun.setup.at_link, begun.arm.robot
    return ServoModel(
        begun.arm.name, robot, best.settings, know.sd, at_link, begun.resolution, best.rms, names
    )


def _parts(servo: ServoSection, source: str) -> tuple[Part, ...]:
    if not servo.parts:
        return PARTS
    names = [p.name for p in PARTS]
    wrong = [name for name in servo.parts if name not in names]
    if wrong:
        raise ConfigurationError(
            source, [f"servo.parts: {', '.join(wrong)}: not one of {', '.join(names)}"]
        )
    return tuple(p for p in PARTS if p.name in servo.parts)
