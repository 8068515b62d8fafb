"""Where an identification by simulation begins: arm, recordings, and what is known of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.compiled_chain import chain_of, torques
from ident.model.arm import Arm
from ident.output_error.first_guess import first_guess
from ident.output_error.parameters import QUANTITIES, ROW
from ident.output_error.recordings import SEARCHED_S, settled, thinned
from ident.output_error.servo_model import STEP_S
from ident.output_error.setup import MotionSegment, Prior, Setup
from ident.output_error.slopes import SLOPE_STEP_S
from ident.recordings.samples import smallest_step
from ident.signals.arrays import Array
from wamctl.arm.errors import ConfigurationError, DataError
from wamctl.arm.robot import cad_parameters

_MOVES = 0.02  # a joint that spans less is held [rad]
_TOO_FAR = 2.0  # times the range that the URDF allows: another unit
_SD = 3.0
_SAME = {"stiffness": 0.03, "rate_gain": 0.3, "profile_acceleration": 0.03, "delay": 0.2}
"""Spread of coordinates over servos of one kind."""

_PLACES, _ROUNDED = 7, 1e-7  # of positions [rad]
_SMALL = 8.0  # times the step: larger moves carry its error too often
_PARTS = 16
_NEAR, _NEARLY_ALL = 0.1, 0.95  # of a multiple, and of the moves; by chance a fifth is as near
_LEAST_WEIGHT = 1e-3  # N m: a joint that lifts less knows no zero


@dataclass(frozen=True)
class Prepared:
    """An arm, its recordings, and where a fit of them begins.

    Attributes:
        arm: kinematics, links, and what its file says of the servos.
        setup: it, along all recordings.
        prior: what is believed before the data; its centre is the first guess.
        may: what may be fitted, shape (quantities, n): not what is known, nor joints at rest.
        moving: which joints moved, shape (n,).
        begins: whether the arm's file says where its fit begins, shape (quantities, n).
    """

    arm: Arm
    setup: Setup
    prior: Prior
    may: NDArray[np.bool_]
    moving: NDArray[np.bool_]
    begins: NDArray[np.bool_]

    @property
    def start(self) -> Array:
        """The first guess, shape (quantities, n)."""
        return self.prior.center

    @property
    def resolution(self) -> Array:
        """Smallest step of the positions [rad], shape (n,)."""
        return self.setup.resolution

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
    _check_unit(arm, span, f"{segments[0].name}: ", "moves")
    asked = np.ptp(np.concatenate([s.motion.command for s in segments]), axis=0)
    _check_unit(arm, asked, f"{segments[0].name}: the command of ", "goes")
    moving = span > _MOVES
    if not moving.any():
        raise DataError(f"No joint moves by more than {_MOVES} rad; nothing can be learned.")
    setup = Setup(
        chain_of(arm.robot),
        cad_parameters(arm.robot),
        np.full(n, arm.servo.encoder == "link"),
        settled(segments),
        STEP_S,
        resolution_of(segments),
    )
    fixed = _given(arm.servo.fixed, n, arm.source)
    first = _given(arm.servo.first, n, arm.source)
    known = np.where(np.isnan(fixed), first, fixed)
    start = first_guess(setup, known, same_servo=arm.servo.same_servo)
    alike = np.full(len(QUANTITIES), np.inf)
    if arm.servo.same_servo:
        alike[[ROW[name] for name in _SAME]] = list(_SAME.values())
    may = np.isnan(fixed) & moving
    may[ROW["delay"]] &= asked > 0.0  # nothing that comes late tells one
    may[ROW["zero"]] &= _weight(setup) > _LEAST_WEIGHT
    prior = Prior(start, np.full(start.shape, _SD), alike)
    return Prepared(arm, setup, prior, may, moving, ~np.isnan(first))


def searched(setup: Setup, seconds: float = SEARCHED_S) -> Setup:
    """What a search fits: pieces of long recordings, in steps that tell play from compliance."""
    return replace(setup, segments=thinned(setup.segments, seconds), step=SLOPE_STEP_S)


def _check_unit(arm: Arm, span: Array, whose: str, does: str) -> None:
    """Refuse angles that span far more than the URDF allows; zeros may lie anywhere."""
    model = arm.robot.model
    allowed = np.asarray(model.upperPositionLimit) - np.asarray(model.lowerPositionLimit)
    wild = np.flatnonzero((allowed > 0.0) & (span > _TOO_FAR * allowed))
    if len(wild):
        joint = int(wild[0])
        raise DataError(
            f"{whose}{arm.robot.joint_names[joint]} {does} through {span[joint]:.4g}, and its URDF"
            f" allows {allowed[joint]:.4g} rad; give positions and commands in rad (in the mapping"
            " of ident import, unit: deg converts degrees, scale and offset what is normalised)."
        )


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


def resolution_of(segments: Sequence[MotionSegment]) -> Array:
    """Step in which positions were told [rad], shape (n,); 0: the joint did not move.

    A motion passes most places of a fine encoder over, and few of its moves may be of one step:
    what lies between places, or the smallest moves, may be several steps. It is the largest part of
    these of which all small moves are multiples; of positions without steps, what these are.
    """
    q = np.concatenate([s.q for s in segments])
    moves = np.abs(np.concatenate([np.diff(s.q, axis=0) for s in segments]))
    steps = np.zeros(q.shape[1])
    for j, column in enumerate(q.T):
        places = np.unique(np.round(column, _PLACES))
        if len(places) > 1:
            most = min(np.median(np.diff(places)), smallest_step(moves[:, j], _ROUNDED))
            steps[j] = _dividing(moves[:, j], float(most))
    return steps


def _dividing(moves: Array, most: float) -> float:
    """The largest part of a step of which small moves are multiples, or the step [rad]."""
    small = moves[(moves > _ROUNDED) & (moves < _SMALL * most)]
    least = float(np.max(small[small <= most], initial=np.min(small, initial=most)))
    for k in range(1, _PARTS + 1):
        counts = small * k / least
        if np.mean(np.abs(counts - np.round(counts)) < _NEAR) > _NEARLY_ALL:
            return least / k
    return most
