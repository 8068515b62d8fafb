"""How wrong inputs are made of right ones."""

import re
from collections.abc import Callable

import numpy as np
from chain_arm import Experiment, Log, inverse, urdf_of

BASE: dict[tuple, Log] = {}


def right(**settings) -> Log:
    """A right recording, made once."""
    key = tuple(sorted(settings.items()))
    if key not in BASE:
        BASE[key] = Experiment(**settings).log()
    return BASE[key]


def scaled(factor, log: Log | None = None) -> Log:
    log = log or right()
    return log.with_(tau=log.tau * np.asarray(factor))


def some_in_degrees(first: int, joints: int) -> Log:
    """The joints from one on in degrees, the others in rad."""
    log = right(joints=joints)
    return log.with_(q=np.where(np.arange(joints) < first, log.q, np.rad2deg(log.q)))


def turned(*joints: int, what: str = "tau") -> Log:
    log = right()
    signs = np.ones(len(log.names))
    signs[list(joints)] = -1
    return log.with_(**{what: getattr(log, what) * signs})


def mirrored(joint: int, joints: int) -> Log:
    """A joint that counts the other way round in position and torque: its power stays the same."""
    log = right(joints=joints, seconds=20.0)
    signs = np.where(np.arange(joints) == joint, -1.0, 1.0)
    return log.with_(q=log.q * signs, tau=log.tau * signs)


def rescaled(joint: int, factor: float) -> Log:
    """One joint's torque with a wrong torque constant or gear ratio."""
    log = right(joints=4)
    return log.with_(tau=log.tau * np.where(np.arange(4) == joint, factor, 1.0))


def of_another_size(size: float, joints: int) -> Log:
    """The URDF of a larger or smaller arm of one series, with masses of its own."""
    log = right(joints=joints, seconds=20.0)
    return log.with_(urdf=urdf_of(joints, 5.0 * size * 0.7 ** np.arange(joints), size=size))


def loaded(mass: float, joints: int) -> Log:
    """A load at the last link, of which the URDF knows nothing."""
    own = 5.0 * 0.7 ** np.arange(joints)
    own[-1] += mass
    return Experiment(joints=joints, seconds=20.0, true_urdf=urdf_of(joints, own)).log()


def carried(mass: float, start: float, end: float, joints: int = 4) -> Log:
    """A load that is there from one part of the recording to another."""
    plain = Experiment(joints=joints, seconds=20.0).log()
    tau = loaded(mass, joints).tau
    share = plain.t / plain.t[-1]
    return plain.with_(tau=np.where(((share >= start) & (share < end))[:, None], tau, plain.tau))


def reordered(order, *what: str, joints: int = 3) -> Log:
    log = right(joints=joints)
    return log.with_(**{w: getattr(log, w)[:, list(order)] for w in what})


def rough(log: Log, *joints: int, share: float = 0.7) -> Log:
    """Torque of some joints that holds something slow beside the arm's own."""
    rng, own = np.random.default_rng(12), np.isin(np.arange(len(log.names)), joints)
    hz, at = rng.uniform(0.05, 0.6, (2, 12, len(log.names)))
    wave = np.sin(2 * np.pi * (hz * log.t[:, None, None] + 9 * at)).sum(axis=1)
    return log.with_(tau=log.tau + own * share * log.tau.std(axis=0) * wave / wave.std(axis=0))


def shifted(joint: int, radians: float) -> Log:
    log = right(joints=4)
    q = log.q.copy()
    q[:, joint] += radians
    return log.with_(q=q, urdf=urdf_of(4, reach=6.0))


def cut(seconds: float, **settings) -> Log:
    log = right(**settings)
    keep = log.t < seconds
    return log.with_(t=log.t[keep], q=log.q[keep], tau=log.tau[keep])


def without(keep, log: Log | None = None) -> Log:
    """Only some samples."""
    log = log or right()
    return log.with_(t=log.t[keep], q=log.q[keep], tau=log.tau[keep])


def thinned(every: int, **settings) -> Log:
    log = right(**settings)
    return log.with_(t=log.t[::every], q=log.q[::every], tau=log.tau[::every])


def stale(share: float, both: bool = True) -> Log:
    """Readings that repeat the one before them."""
    log, rng = right(), np.random.default_rng(1)
    q, tau = log.q.copy(), log.tau.copy()
    for s in np.flatnonzero(rng.uniform(size=len(q)) < share):
        q[s] = q[s - 1]
        if both:
            tau[s] = tau[s - 1]
    return log.with_(q=q, tau=tau)


def skipped(count: int) -> Log:
    """Samples lost while the stamps run on evenly."""
    log = right()
    keep = np.ones(len(log.t), dtype=bool)
    keep[np.random.default_rng(2).choice(len(keep) - 2, count, replace=False) + 1] = False
    return log.with_(t=log.t[: keep.sum()], q=log.q[keep], tau=log.tau[keep])


def shuffled() -> Log:
    log = right()
    order = np.random.default_rng(8).permutation(len(log.t))
    return log.with_(q=log.q[order], tau=log.tau[order])


def holed(*holes: tuple[float, float]) -> Log:
    log = right()
    keep = np.ones(len(log.t), dtype=bool)
    for start, stop in holes:
        keep &= (log.t < start) | (log.t > stop)
    return without(keep, log)


def closed_up(start: float, stop: float) -> Log:
    """A stretch is missing, and the stamps go on as if it were not."""
    log = holed((start, stop))
    return log.with_(t=right().t[: len(log.t)])


def torque(change: Callable[[Log, np.random.Generator], np.ndarray], **settings) -> Log:
    log = right(**settings)
    return log.with_(tau=change(log, np.random.default_rng(3)))


def compensated(joint: int, times: float = 8.0) -> Log:
    """A drive that takes off too much Coulomb friction, and adds as much that grows with speed."""
    log = right()
    speed = np.gradient(log.q[:, joint], log.t)
    tau = log.tau.copy()
    size = 0.05 * np.sqrt(np.mean(tau[:, joint] ** 2))
    tau[:, joint] -= times * size * np.tanh(speed / (0.02 * np.sqrt(np.mean(speed**2))))
    tau[:, joint] += times * size * speed / np.sqrt(np.mean(speed**2))
    return log.with_(tau=tau)


def at_joint(joint: int, values: Callable[[Log, np.random.Generator], np.ndarray]) -> Log:
    def change(log: Log, rng: np.random.Generator) -> np.ndarray:
        tau = log.tau.copy()
        tau[:, joint] = values(log, rng)
        return tau

    return torque(change)


def urdf(change: Callable[[str], str], joints: int = 3) -> Log:
    log = right(joints=joints)
    return log.with_(urdf=change(log.urdf))


def swaying(amplitude: float, hertz: float, axis: int) -> Log:
    def pull(t):
        found = np.tile([0.0, 0.0, -9.81], (len(t), 1))
        found[:, axis] += amplitude * np.sin(2 * np.pi * hertz * t)
        return found

    return Experiment(joints=4, gravity=pull).log()


def still(*joints: int, reach: float) -> Log:
    """Joints that hardly move; their friction stays."""
    log = Experiment(joints=3).log()
    rng = np.random.default_rng(4)
    q, tau = log.q.copy(), log.tau.copy()
    for j in joints:
        q[:, j] = 0.2 + reach * (q[:, j] - q[:, j].mean()) / np.ptp(q[:, j])
        tau[:, j] = tau[:, j].mean() + 0.1 * rng.normal(size=len(q))
    return log.with_(q=q, tau=tau)


def interleaved() -> Log:
    """Two arms on one topic, in turn."""
    log, other = right(), Experiment(seed=9).log()
    q, tau = log.q.copy(), log.tau.copy()
    q[1::2], tau[1::2] = other.q[1::2], other.tau[1::2]
    return log.with_(q=q, tau=tau)


def glitches(joint: int, count: int) -> Log:
    log = right()
    q = log.q.copy()
    q[np.random.default_rng(5).choice(len(q), count, replace=False), joint] += 2 * np.pi
    return log.with_(q=q)


def spikes(deviations: float, count: int = 8) -> Log:
    """Single torques of each joint that are so many standard deviations off."""
    log, rng = right(), np.random.default_rng(6)
    tau = log.tau.copy()
    for k, size in enumerate(deviations * tau.std(axis=0)):
        tau[rng.choice(len(tau), count, replace=False), k] += size * rng.choice((-1, 1), count)
    return log.with_(tau=tau)


def flipped(seed: int, count: int = 10) -> Log:
    """Flipped bits among the numbers, as a log without checksums may have them."""
    log, rng = right(), np.random.default_rng(seed)
    arrays = [log.q.copy(), log.tau.copy()]
    for _ in range(count):
        bits = arrays[rng.integers(2)].reshape(-1).view(np.uint64)
        bits[rng.integers(len(bits))] ^= np.uint64(1) << np.uint64(rng.integers(64))
    return log.with_(q=arrays[0], tau=arrays[1])


def late(samples: int, *joints: int, **settings) -> Log:
    """Torque that was recorded later than the motion, of some joints or of all."""
    log = right(**settings)
    places = list(joints) or list(range(len(log.names)))
    tau = log.tau.copy()
    rows = np.clip(np.arange(len(tau)) - samples, 0, len(tau) - 1)
    tau[:, places] = tau[np.ix_(rows, places)]
    return log.with_(tau=tau)


def frozen(*joints: int) -> Log:
    """A torque sensor that stays at its last reading from half the recording on."""
    log = right()
    tau, half = log.tau.copy(), len(log.t) // 2
    tau[half:, list(joints)] = tau[half, list(joints)]
    return log.with_(tau=tau)


def frozen_and_interpolated(joint: int) -> Log:
    """The same at other instants than it was read at: equal values differ by rounding there."""
    log, rng = frozen(joint), np.random.default_rng(0)
    return log.with_(tau=log.tau * (1 + 1e-15 * rng.normal(size=log.tau.shape)))


def slipped(joint: int, by: float) -> Log:
    """An encoder that loses counts half-way [rad]."""
    log = right()
    q = log.q.copy()
    q[len(q) // 2 :, joint] += by
    return log.with_(q=q)


def stood(joint: int, first: int, end: int) -> Log:
    """An encoder whose reading stays the same from one sample to another."""
    log = right()
    q = log.q.copy()
    q[first:end, joint] = q[first, joint]
    return log.with_(q=q)


def weightless(**settings) -> Log:
    """Torque that a controller reports beside its gravity compensation."""
    log = right(**settings)
    still = np.zeros_like(log.q)
    return log.with_(tau=log.tau - inverse(log.urdf, log.q, still, still))


def in_turn(joints: int) -> Log:
    """One frequency for all joints, in phase: nothing is told apart."""
    log = Experiment(joints=joints).log()
    wave = 0.4 * np.sin(0.2 * np.pi * log.t)
    return moved_so(log, np.tile(wave[:, None], (1, joints)))


def on_one_line(aside: float) -> Log:
    """Two joints that follow a third, at many speeds, but for a part of their own motion."""
    log = Experiment(joints=3).log()
    q = log.q - log.q.mean(axis=0)
    own = q / q.std(axis=0) @ np.linalg.cholesky(np.full((3, 3), 1 - aside) + aside * np.eye(3)).T
    return moved_so(log, 0.3 + own * q.std(axis=0))


def moved_so(log: Log, q: np.ndarray) -> Log:
    """The arm of a recording along another motion, its torque rough by a fiftieth."""
    qd = np.gradient(q, log.t, axis=0)
    qdd = np.gradient(qd, log.t, axis=0)
    tau = inverse(log.urdf, q, qd, qdd)
    tau += 0.02 * tau.std(axis=0) * np.random.default_rng(6).normal(size=tau.shape)
    return log.with_(q=q, tau=tau)


def stretched(factor: float, *joints: int, **settings) -> Log:
    """Positions of some joints, or of all, by a wrong gear ratio or number of counts."""
    log = right(**settings)
    n = len(log.names)
    return log.with_(q=log.q * np.where(np.isin(np.arange(n), joints or range(n)), factor, 1.0))


def drifting(joint: int, radians: float, **settings) -> Log:
    """An encoder that loses counts all the time."""
    log = right(**settings)
    q = log.q.copy()
    q[:, joint] += radians * log.t / log.t[-1]
    return log.with_(q=q)


def offset(joint: int, torque_nm: float, **settings) -> Log:
    log = right(**settings)
    return log.with_(tau=log.tau + torque_nm * (np.arange(len(log.names)) == joint))


def clipped(share: float, **settings) -> Log:
    """A torque sensor whose range ends at a share of each joint's largest torque."""
    log = right(**settings)
    most = share * np.abs(log.tau).max(axis=0)
    return log.with_(tau=np.clip(log.tau, -most, most))


def inertia(text: str) -> str:
    return re.sub(r'ixx="[^"]*"', 'ixx="-0.02"', text, count=1)


def no_inertials(text: str) -> str:
    return re.sub(r"<inertial>.*?</inertial>", "", text, flags=re.S)


def mass(text: str, link: int, value: float) -> str:
    found = list(re.finditer(r'<mass value="([^"]*)"', text))[link]
    return text[: found.start(1)] + str(value) + text[found.end(1) :]
