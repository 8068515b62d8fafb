"""Faults of the data, looked for before any physics."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.dynamics.compiled_chain import chain_of, torques
from ident.effects.catalogue import torque_scale_effect
from ident.effects.events import DROPPED_SAMPLES
from ident.gap.data.experiment import Experiment
from wamctl.arm.recording import Recording
from wamctl.arm.robot import cad_parameters

Array = NDArray[np.floating]

_FAST_STEPS = 12.0  # a move of so many smallest ones, or usual errors, shows a lost sample
_SHARE = 2e-4  # of the samples
_LEAST_EVENTS = 4
_CLEAR = 0.7  # correlation that makes a gain meaningful
_GAIN = (0.25, 4.0)
_HELD, _JUMPED = 0.25, 1.75  # of the expected move
_HOLE = 1.5  # periods
_MADE_UP = 4  # steps within which a late sample is made up for
_ROUNDING = 1e-9  # rad: two motors' counts that cancel leave no more


@dataclass(frozen=True)
class Fault:
    """Something wrong with the data.

    Attributes:
        name: id of the effect that stands for it.
        joints: from 0; empty where all are affected.
        text: the whole sentence.
        count: how often, or the gain that was found.
    """

    name: str
    joints: tuple[int, ...]
    text: str
    count: float


def faults(source: Experiment) -> list[Fault]:
    """All faults of some recordings."""
    found = []
    for recording, data in zip(source.recordings, source.datasets, strict=True):
        found += _stamps(recording, data.name)
        found += _samples(recording, data.name)
    return found + _channels(source)


def _stamps(recording: Recording, name: str) -> list[Fault]:
    steps = np.diff(recording.stamp_ns)
    period = float(np.median(steps))
    repeated = int((steps <= 0).sum())
    lost = _lost(steps, period)
    count = lost + repeated
    if count < max(_LEAST_EVENTS, _SHARE * len(steps)):
        return []
    text = f"{name}: {lost} samples are missing by their stamps, and {repeated} stamps repeat."
    return [Fault(DROPPED_SAMPLES.id, (), text, count)]


def _lost(steps: NDArray[np.int64], period: float) -> int:
    """Samples that are missing; a late one is made up for by the short steps after it."""
    lost, end = 0, 0
    for i in np.flatnonzero(steps > _HOLE * period):
        if i >= end:
            end = i + _MADE_UP
            lost += max(round(float(steps[i:end].sum()) / period) - len(steps[i:end]), 0)
    return lost


def _samples(recording: Recording, name: str) -> list[Fault]:
    """Positions that repeat, or jump by two samples' way, on all joints at once."""
    step = np.diff(recording.q, axis=0)
    before, after = step[:-4], step[4:]
    expected = 0.25 * (before + step[1:-3] + step[3:-1] + after)
    here = step[2:-2]
    least = np.maximum([_smallest(s) for s in step.T], _usual(here - expected))
    fast = np.abs(expected) > _FAST_STEPS * np.maximum(least, _ROUNDING)
    ratio = here / np.where(fast, expected, np.inf)
    enough = fast.sum(axis=1) >= 2
    repeated = int((enough & (~fast | (ratio < _HELD)).all(axis=1)).sum())
    jumped = int((enough & (~fast | (ratio > _JUMPED)).all(axis=1)).sum())
    count = repeated + jumped
    if count < max(_LEAST_EVENTS, _SHARE * len(step)):
        return []
    text = (
        f"{name}: {repeated} samples repeat the one before, and {jumped} times a sample is lost,"
        " on all moving joints at once, although the stamps are even."
    )
    return [Fault(DROPPED_SAMPLES.id, (), text, count)]


def _smallest(step: Array) -> float:
    """The smallest move of a joint from sample to sample [rad]."""
    moved = np.abs(step[np.abs(step) > _ROUNDING])
    return float(np.quantile(moved, 0.02)) if len(moved) else 1.0


def _usual(error: Array) -> Array:
    """Size of most errors of each joint [rad], shape (n,)."""
    return 1.5 * np.median(np.abs(error), axis=0) if len(error) else np.zeros(error.shape[1])


def _channels(source: Experiment) -> list[Fault]:
    """Sign and unit of the torque, against the CAD model and against the work of friction."""
    robot = source.arm.robot
    chain, delta = chain_of(robot), cad_parameters(robot)
    model, torque, power = [], [], []
    for data in source.datasets:
        for segment in data.segments:
            every = max(1, round(data.rate_hz / 20.0))
            q = np.ascontiguousarray(segment.q[::every])
            tau = segment.tau[::every]
            speed = np.gradient(q, every / data.rate_hz, axis=0)
            rate = np.gradient(speed, every / data.rate_hz, axis=0)
            model.append(torques(chain, delta, q, speed, rate))
            torque.append(tau)
            power.append(tau * speed)
    return _signs(source, np.concatenate(model), np.concatenate(torque), np.concatenate(power))


def _signs(source: Experiment, model: Array, torque: Array, power: Array) -> list[Fault]:
    found = []
    known = []
    for j in np.flatnonzero(source.moving):
        size = float(np.linalg.norm(model[:, j]) * np.linalg.norm(torque[:, j]))
        if size == 0.0:
            continue
        inner = float(model[:, j] @ torque[:, j])
        work = power[:, j]
        against = work.mean() < -4.0 * work.std() / np.sqrt(max(len(work) / 40.0, 1.0))
        if inner / size < -_CLEAR or (against and inner / size < 0.3):
            text = f"The torque of joint {j + 1} has the wrong sign: it takes energy from friction."
            found.append(Fault(torque_scale_effect().id, (int(j),), text, -1.0))
        elif inner / size > _CLEAR:
            known.append(inner / float(model[:, j] @ model[:, j]))
    if known and not found:
        gain = float(np.median(known))
        if not _GAIN[0] < gain < _GAIN[1]:
            text = (
                f"The torque is {gain:.3g} times what the arm's own weight asks for: its unit is"
                " wrong; give joint torque in N m."
            )
            found.append(Fault(torque_scale_effect().id, (), text, gain))
    return found
