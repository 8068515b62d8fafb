"""Identification by simulation: from recordings to servos, gears, friction, and zeros."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.compiled_chain import chain_of, torques
from ident.model.arm import Arm
from ident.output_error.first_guess import first_guess
from ident.output_error.fit import SLOPE_STEP_S, Fit, MotionSegment, Prior, Setup, fit
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.recordings import parted, settled
from ident.output_error.selection import PARTS, Chosen, Part, chosen
from ident.output_error.servo_model import STEP_S, ServoModel
from ident.output_error.uncertainty import Knowledge, knowledge
from ident.regression.progress import Tell
from ident.signals.arrays import Array
from wamctl.arm.config import ServoSection
from wamctl.arm.errors import ConfigurationError, DataError
from wamctl.arm.robot import cad_parameters

_PIECE_S = 8.0
_SEARCHED_S = 150.0  # more than this tells the search nothing new
_MOVES = 0.02  # a joint that spans less is held [rad]
_TOO_FAR = 2.0  # times the range that the URDF allows: another unit
_SD = 3.0
_SAME = {"stiffness": 0.03, "rate_gain": 0.3, "profile_acceleration": 0.03, "delay": 0.2}
"""Spread of coordinates over servos of one kind."""

_LIMITS = ("torque_limit", "profile_speed", "profile_acceleration")
_IDLE = 0.01  # encoder steps: a limit that moves no sample by more is not reached
_LEAST_WEIGHT = 1e-3  # N m: a joint that lifts less knows no zero
_ROUNDS = 12


@dataclass(frozen=True)
class Found:
    """An identification by simulation.

    Attributes:
        model: the arm.
        setup: it, along all recordings.
        fit: of all recordings.
        search: which parts were tried.
        known: how well the settings are known.
        moving: which joints moved, shape (n,).
    """

    model: ServoModel
    setup: Setup
    fit: Fit
    search: Chosen
    known: Knowledge
    moving: NDArray[np.bool_]


@dataclass(frozen=True)
class Prepared:
    """An arm, its recordings, and where a fit of them begins.

    Attributes:
        arm: kinematics, links, and what its file says of the servos.
        setup: it, along all recordings.
        prior: what is believed before the data; its centre is the first guess.
        may: what may be fitted, shape (quantities, n): not what is known, nor joints at rest.
        moving: which joints moved, shape (n,).
        resolution: smallest step of the positions [rad], shape (n,).
    """

    arm: Arm
    setup: Setup
    prior: Prior
    may: NDArray[np.bool_]
    moving: NDArray[np.bool_]
    resolution: Array

    @property
    def start(self) -> Array:
        """The first guess, shape (quantities, n)."""
        return self.prior.center

    @property
    def same_servo(self) -> bool:
        """Whether all joints have the same."""
        return self.arm.servo.same_servo


def prepared(arm: Arm, segments: Sequence[MotionSegment]) -> Prepared:
    """Where an identification begins.

    Raises:
        DataError: no joint moves, or one farther than its limits allow.
        ConfigurationError: the arm's file names quantities that do not exist.
    """
    n = arm.robot.dof
    span = np.ptp(np.concatenate([s.q for s in segments]), axis=0)
    _check_unit(arm, span, segments[0].name)
    moving = span > _MOVES
    if not moving.any():
        raise DataError(f"No joint moves by more than {_MOVES} rad; nothing can be learned.")
    setup = Setup(
        chain_of(arm.robot),
        cad_parameters(arm.robot),
        np.full(n, arm.servo.encoder == "link"),
        settled(segments),
        STEP_S,
    )
    fixed = _given(arm.servo.fixed, n, arm.source)
    known = np.where(np.isnan(fixed), _given(arm.servo.first, n, arm.source), fixed)
    start = first_guess(setup, known, same_servo=arm.servo.same_servo)
    alike = np.full(len(QUANTITIES), np.inf)
    if arm.servo.same_servo:
        alike[[ROW[name] for name in _SAME]] = list(_SAME.values())
    may = np.isnan(fixed) & moving
    may[ROW["zero"]] &= _weight(setup) > _LEAST_WEIGHT
    prior = Prior(start, np.full(start.shape, _SD), alike)
    return Prepared(arm, setup, prior, may, moving, _resolution(segments))


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
    begun = prepared(arm, segments)
    searched, other = _folds(begun.setup)
    search = chosen(
        searched, other, begun.start, begun.prior, begun.may, parts, begun.same_servo, tell
    )
    best = fit_of_all(begun, search.fit, tell)
    tell("how well it is known")
    know = knowledge(begun.setup, best, begun.prior)
    model = model_of(begun, best, know)
    return Found(model, begun.setup, best, search, know, begun.moving)


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


def _check_unit(arm: Arm, span: Array, name: str) -> None:
    """Refuse positions that span far more than the URDF allows; zeros may lie anywhere."""
    model = arm.robot.model
    allowed = np.asarray(model.upperPositionLimit) - np.asarray(model.lowerPositionLimit)
    wild = np.flatnonzero((allowed > 0.0) & (span > _TOO_FAR * allowed))
    if len(wild):
        joint = int(wild[0])
        raise DataError(
            f"{name}: {arm.robot.joint_names[joint]} moves through {span[joint]:.4g}, and its URDF"
            f" allows {allowed[joint]:.4g}; give positions and commands in rad (unit: deg in the"
            " mapping of ident import converts them)."
        )


def _folds(setup: Setup) -> tuple[Setup, Setup]:
    """Two thirds of the pieces to search, one third to judge; long recordings are thinned."""
    cut = parted(setup.segments, _PIECE_S)
    stride = max(int(len(cut) * _PIECE_S / (1.5 * _SEARCHED_S)), 1)
    thin = cut[::stride]
    if len(thin) < 3:
        thin = cut
    searched = tuple(s for i, s in enumerate(thin) if i % 3 != 2)
    other = tuple(s for i, s in enumerate(thin) if i % 3 == 2)
    coarse = replace(setup, step=SLOPE_STEP_S)
    return replace(coarse, segments=searched), replace(coarse, segments=other)


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


def _given(values: dict, n: int, source: str) -> Array:
    """Settings that a file gives, NaN elsewhere, shape (quantities, n)."""
    wrong = [name for name in values if name not in ROW]
    if wrong:
        raise ConfigurationError(
            source, [f"servo: {', '.join(wrong)}: not one of {', '.join(ROW)}"]
        )
    given = np.full((len(QUANTITIES), n), np.nan)
    for name, value in values.items():
        if np.size(value) not in (1, n):
            raise ConfigurationError(
                source, [f"servo: {name}: {np.size(value)} values for {n} joints"]
            )
        q = QUANTITIES[ROW[name]]
        if np.min(value) < q.low or np.max(value) > q.high:
            bounds = f"{q.low:g} to {q.high:g} {q.unit}"
            raise ConfigurationError(source, [f"servo: {name}: {value} is not within {bounds}"])
        given[ROW[name]] = value
    return given


def _weight(setup: Setup) -> Array:
    """Largest torque of gravity along the recordings [N m], shape (n,)."""
    largest = np.zeros(len(setup.at_link))
    for s in setup.segments:
        q = np.ascontiguousarray(s.q[::10])
        still = np.zeros_like(q)
        held = torques(setup.chain, setup.delta, q, still, still)
        largest = np.maximum(largest, np.abs(held).max(axis=0))
    return largest


def _resolution(segments: Sequence[MotionSegment]) -> Array:
    """Smallest step between the positions that were told [rad], shape (n,)."""
    q = np.concatenate([s.q for s in segments])
    steps = np.zeros(q.shape[1])
    for j, column in enumerate(q.T):
        places = np.unique(np.round(column, 7))
        steps[j] = np.median(np.diff(places)) if len(places) > 1 else 0.0
    return steps
