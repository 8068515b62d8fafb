"""What a trusted model leaves unexplained, as rows of regression, sample by sample in order."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
import scipy.signal
from numpy.typing import NDArray

from ident.dynamics.compiled_chain import chain_of
from ident.dynamics.compiled_regressor import regressor
from ident.fleet.normal import Information, nothing
from ident.model.identified_model import Model
from ident.signals.arrays import Array
from ident.watch.samples import Samples
from ident.watch.settings import WatchSettings

PAYLOAD, FORCE = 10, 3
"""Columns of a load at the tool (mass, first moments, inertia), and of a push."""

_TOOL = [9, 6, 7, 8, 0, 1, 2, 3, 4, 5]
_HIGHEST = 0.2  # of the sampling rate


class CausalFilter:
    """A third-order Butterworth low-pass that gives value, rate and acceleration.

    Its state-space form has the derivatives of its output as states, so that all three belong to
    one instant, and to that of any other signal through the same filter.

    Args:
        cutoff_hz: [Hz].
        period_s: between samples [s].
    """

    def __init__(self, cutoff_hz: float, period_s: float) -> None:
        w = 2 * np.pi * cutoff_hz
        A = np.array([[0, 1, 0], [0, 0, 1], [-(w**3), -2 * w**2, -2 * w]], dtype=float)
        B = np.array([[0.0], [0.0], [w**3]])
        # held samples would bend the acceleration between them; straight lines do not
        system: Any = (A, B, np.eye(3), np.zeros((3, 1)))
        discrete: Any = scipy.signal.cont2discrete(system, period_s, method="foh")
        self._numerators, self._denominator = scipy.signal.ss2tf(*discrete[:4])
        self._states: list[Array] | None = None

    def __call__(self, values: Array, derivatives: int) -> list[Array]:
        """The filtered samples and their derivatives, each of shape (S, n)."""
        if self._states is None:
            start = scipy.signal.lfilter_zi(self._numerators[0], self._denominator)
            zero = np.zeros((3, values.shape[1]))
            rest = [zero + self._held(k)[:, None] * values[0] for k in (1, 2)]
            self._states = [start[:, None] * values[0], *rest]
        found = []
        for k in range(derivatives + 1):
            y, self._states[k] = scipy.signal.lfilter(
                self._numerators[k], self._denominator, values, axis=0, zi=self._states[k]
            )
            found.append(y)
        return found

    def _held(self, k: int) -> Array:
        """State of a derivative's filter that has always seen 1."""
        return scipy.signal.lfilter_zi(self._numerators[k], self._denominator)


@dataclass(frozen=True)
class Window:
    """What some consecutive rows say of the columns.

    Attributes:
        start_ns, end_ns: its first and last instant [ns].
        said: of p columns: load, push, then per joint viscous, dry and constant torque.
        moving: whether any row could be used.
    """

    start_ns: int
    end_ns: int
    said: Information
    moving: bool


class _Thinned:
    """Every so-manieth of samples that come in parts."""

    def __init__(self, every: int) -> None:
        self.every = every
        self._count = 0

    def places(self, count: int) -> NDArray[np.int64]:
        """Places among the next samples."""
        found = np.arange(-self._count % self.every, count, self.every)
        self._count += count
        return found


class Residual:
    """Rows of what the model leaves, gathered in windows.

    Args:
        model: the trusted model.
        settings: of the watch.
    """

    def __init__(self, model: Model, settings: WatchSettings) -> None:
        self._model, self._settings = model, settings
        self._chain = chain_of(model.robot)
        self._data = model.robot.data()
        n = model.robot.dof
        self.count = PAYLOAD + FORCE + 3 * n
        known = np.nan_to_num(model.noise, nan=np.inf)
        noise = settings.noise_factor * np.maximum(known, 1e-9)
        self.noise = noise
        self._fresh(0.0)

    def _fresh(self, period_s: float) -> None:
        settings = self._settings
        self._period_s = period_s
        self._since_slow = np.zeros(self._model.robot.dof)
        self._said, self._rows, self._start_ns = nothing(self.count), 0, 0
        if not period_s:
            return
        cutoffs = (settings.motion_hz, settings.motion_hz, settings.speed_hz)
        self._motion, self._torque, self._early = (
            CausalFilter(min(f, _HIGHEST / period_s), period_s) for f in cutoffs
        )
        self._kept = _Thinned(max(1, int(1 / (settings.rows_hz * period_s))))
        self._row_s = self._kept.every * period_s
        self._skip = round(settings.start_s / self._row_s)
        self._weight = settings.values_per_s * self._row_s / self.noise**2

    def windows(self, samples: Samples) -> list[Window]:
        """The windows that these samples complete."""
        if samples.fresh or not self._period_s:
            self._fresh(samples.period_s)
        (tau,) = self._torque(samples.tau, 0)
        _, early = self._early(samples.q, 1)
        motion = self._motion(samples.q, 2)
        kept = self._kept.places(len(tau))
        q, qd, qdd = (a[kept] for a in motion)
        left = tau[kept] - self._model.inverse_dynamics(q, qd, qdd)
        used = self._known_friction(qd, early[kept])
        parts = (self._columns(q, qd, qdd), left[..., None], used[..., None])
        rows = np.concatenate(parts, axis=2)
        ns = samples.start_ns + np.round(kept * self._period_s * 1e9).astype(np.int64)
        skipped = min(self._skip, len(rows))
        self._skip -= skipped
        return self._gathered(rows[skipped:], ns[skipped:])

    def _gathered(self, rows: Array, ns: NDArray[np.int64]) -> list[Window]:
        """The windows that more rows complete; rows [X | torque left | whether used]."""
        found = []
        size = max(1, round(self._settings.window_s / self._row_s))
        while len(rows):
            count = min(size - self._rows, len(rows))
            self._start_ns = self._start_ns if self._rows else int(ns[0])
            self._said = self._said + self._of_rows(rows[:count])
            self._rows += count
            if self._rows == size:
                moving = bool(self._said.N.any())
                found.append(Window(self._start_ns, int(ns[count - 1]), self._said, moving))
                self._said, self._rows = nothing(self.count), 0
            rows, ns = rows[count:], ns[count:]
        return found

    def _of_rows(self, rows: Array) -> Information:
        used = rows[..., -1] * np.sqrt(self._weight)
        X = (rows[..., :-2] * used[..., None]).reshape(-1, self.count)
        torque = (rows[..., -2] * used).ravel()
        return Information(X.T @ X, X.T @ torque)

    def _known_friction(self, qd: Array, early: Array) -> Array:
        """One where a joint has moved for a while and goes on, else zero, shape (S, n).

        Args:
            qd: velocity, as late as the torque, shape (S, n).
            early: the same through a faster filter, which tells of a reversal before, shape (S, n).
        """
        used = np.empty(qd.shape)
        least = self._settings.slowest_rad_s
        for k, (now, next_) in enumerate(zip(qd, early, strict=True)):
            slow = (np.minimum(np.abs(now), np.abs(next_)) < least) | (now * next_ <= 0.0)
            self._since_slow = np.where(slow, 0.0, self._since_slow + self._row_s)
            used[k] = self._since_slow > self._settings.settling_s
        return used * self._model.moving

    def _columns(self, q: Array, qd: Array, qdd: Array) -> Array:
        S, n = q.shape
        X = np.zeros((S, n, self.count))
        parts = (np.ascontiguousarray(a) for a in (q, qd, qdd))
        X[..., :PAYLOAD] = regressor(self._chain, *parts)[:, :, -10:][..., _TOOL]
        model = self._model.robot.model
        for s in range(S):
            pin.computeJointJacobians(model, self._data, q[s])
            J = pin.getJointJacobian(model, self._data, n, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
            X[s, :, PAYLOAD : PAYLOAD + FORCE] = -J.reshape(6, n)[:3].T
        joints, first = np.arange(n), PAYLOAD + FORCE
        for k, values in enumerate((qd, np.sign(qd), np.ones_like(qd))):
            X[:, joints, first + k * n + joints] = values
        return X
