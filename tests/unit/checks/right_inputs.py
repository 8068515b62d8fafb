"""Right inputs: none may be refused, and none doubted without the reason that stands beside it."""

from collections.abc import Callable

import mujoco
import numpy as np
from chain_arm import Experiment, Log, motion, names_of, urdf_of
from wrong_inputs import loaded

Right = tuple[str, Callable[[], Log], set[str]]


def thinned(every: int, **settings) -> Log:
    log = Experiment(**settings).log()
    return log.with_(t=log.t[::every], q=log.q[::every], tau=log.tau[::every])


def rounded_clock(**settings) -> Log:
    """Samples every 10.6 ms, whose stamps come from a clock with ticks of 2 ms."""
    log = Experiment(rate_hz=94.0, **settings).log()
    return log.with_(t=np.round(log.t / 0.002) * 0.002)


def light_and_slow(seed: int) -> Log:
    """A joint that carries no weight, beside which the sensors' noise is large."""
    log, rng = Experiment(joints=6, seconds=60.0, rate_hz=20.0, speed=0.1, seed=seed,
                        friction=0.0, noise=0.0).log(), np.random.default_rng(seed)  # fmt: skip
    most = np.sqrt(np.mean(log.tau**2, axis=0)).max()
    sign = np.tanh(np.gradient(log.q, log.t, axis=0) / 0.02)
    noise = 5e-3 * rng.normal(size=log.tau.shape)
    return log.with_(tau=log.tau + most * (noise + 3e-3 * sign))


def heavier(factor: float, **settings) -> Log:
    """An arm that is not quite its URDF's: every link but the last by a factor."""
    log = Experiment(**settings).log()
    n = len(log.names)
    own = 5.0 * 0.7 ** np.arange(n)
    own[:-1] *= factor
    return Experiment(**settings, true_urdf=urdf_of(n, own)).log()


def sprung(joint: int, strength: float, seed: int) -> Log:
    """A spring at a joint, so many times as strong as its torque without one is."""
    log = Experiment(joints=4, seconds=20.0, seed=seed).log()
    stiffness = strength * np.sqrt(np.mean(log.tau**2, axis=0)) / log.q.std(axis=0)
    own = np.arange(4) == joint
    return log.with_(tau=log.tau + own * stiffness * (log.q - log.q.mean(axis=0)))


def then_still(seconds: float) -> Log:
    """A motion, after which the arm stands still and its encoders flicker."""
    log, rng = Experiment(joints=4, rate_hz=500.0, seconds=15.0).log(), np.random.default_rng(0)
    count = round(500 * seconds)
    q = log.q[-1] + 1e-6 * rng.normal(size=(count, 4))
    held = log.tau[-1] + np.zeros((count, 1))
    t = log.t[-1] + np.arange(1, count + 1) / 500
    both = {"t": t, "q": q, "tau": held}
    return log.with_(**{k: np.concatenate([getattr(log, k), v]) for k, v in both.items()})


def flickering() -> Log:
    """Now and then a sample is off by a thousandth of a joint's range, in steps far below."""
    log, rng = Experiment(rate_hz=500.0, speed=0.3, seconds=40.0).log(), np.random.default_rng(3)
    q = log.q + 1e-7 * rng.normal(size=log.q.shape)
    q[rng.choice(len(q) - 2, 8) + 1, 1] += 1e-3 * np.ptp(q[:, 1])
    return log.with_(q=q)


def on_a_slide() -> Log:
    """A vertical slide, whose weight is one constant force, carries two joints."""
    urdf = urdf_of(3).replace('"joint_1" type="revolute"', '"joint_1" type="prismatic"')
    log = Experiment(joints=3, seconds=20.0, true_urdf=urdf).log()
    return log.with_(urdf=urdf)


def at_its_limit() -> Log:
    """Motors that give what the motion takes and nothing for friction: the arm lags there."""
    free = Experiment(joints=2, seconds=20.0, friction=0.0, noise=0.0).log()
    most = np.abs(free.tau).max(axis=0)
    step_s, rng = 1e-3, np.random.default_rng(0)
    wanted, speed, _ = motion(np.arange(20_000) * step_s, 2, rng)
    model = mujoco.MjModel.from_xml_string(urdf_of(2))
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    model.opt.timestep, model.jnt_limited[:] = step_s, 0
    model.dof_damping[:] = 0.05 * most
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = wanted[0], speed[0]
    q, tau = np.empty_like(wanted), np.empty_like(wanted)
    for k, (goal, rate) in enumerate(zip(wanted, speed, strict=True)):
        pull = most * (30.0 * (goal - data.qpos) + 6.0 * (rate - data.qvel))
        q[k], tau[k] = data.qpos, np.clip(pull, -most, most)
        data.qfrc_applied[:] = tau[k]
        mujoco.mj_step(model, data)
    kept = slice(0, None, 5)
    return Log(urdf_of(2), np.arange(20_000)[kept] * step_s, q[kept], tau[kept], names_of(2))


def odd_base() -> Log:
    """A link of the base that is impossible, and has no part in any torque."""
    log = Experiment(joints=3).log()
    inertia = '<mass value="1"/><inertia ixx="-1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    base = f'<link name="base"><inertial>{inertia}</inertial></link>'
    return log.with_(urdf=log.urdf.replace('<link name="base"/>', base))


RIGHT: list[Right] = [
    *(
        (f"{n} joints", lambda n=n: Experiment(joints=n, seconds=20.0 + 5 * (n > 6)).log(), set())
        for n in range(1, 13)
    ),
    *(
        (f"{n} joints, half the rate", lambda n=n: thinned(2, joints=n, seconds=20.0), set())
        for n in (2, 4, 6)
    ),
    *(
        (f"{n} joints, 25 Hz", lambda n=n: thinned(4, joints=n, seconds=20.0), set())
        for n in (2, 4)
    ),
    *(
        (f"{n} joints, 1 kHz", lambda n=n: Experiment(joints=n, rate_hz=1000.0).log(), set())
        for n in (2, 3)
    ),
    *(
        (f"{s:g} s of 3 joints", lambda s=s: Experiment(seconds=s).log(), set())
        for s in (8.0, 10.0, 15.0, 30.0)
    ),
    *(
        (f"{s:g} s of 6 joints", lambda s=s: Experiment(joints=6, seconds=s).log(), set())
        for s in (12.0, 15.0, 40.0)
    ),
    ("stamps of 10 and 12 ms", lambda: rounded_clock(joints=4), set()),
    *((f"seed {s}", lambda s=s: Experiment(joints=4, seed=s).log(), set()) for s in range(1, 7)),
    *((f"size {s:g}", lambda s=s: Experiment(joints=4, size=s).log(), set()) for s in (0.3, 3.0)),
    *(
        (f"friction {f:g}", lambda f=f: Experiment(joints=4, friction=f).log(), set())
        for f in (0.0, 0.3, 1.0)
    ),
    *(
        (f"noise {x:g}", lambda x=x: Experiment(joints=4, noise=x).log(), set())
        for x in (0.0, 0.05, 0.15)
    ),
    *(
        (
            f"speed {v:g}",
            lambda v=v: Experiment(joints=4, seconds=24 / v, rate_hz=100 * v, speed=v).log(),
            set(),
        )
        for v in (0.5, 2.0, 3.0)
    ),
    *((f"light and slow, seed {s}", lambda s=s: light_and_slow(s), set()) for s in (1, 2)),
    *((f"masses by {f:g}", lambda f=f: heavier(f, joints=4), set()) for f in (0.6, 1.5, 2.5)),
    ("an impossible base", odd_base, set()),
    *(
        (f"a spring at joint {k + 1}, seed {s}", lambda k=k, x=x, s=s: sprung(k, x, s), codes)
        for k, x, s, codes in (
            (1, -2, 1, set()),
            (3, 2, 1, set()),
            (3, -2, 0, {"impossible_torque"}),
            (2, -2, 2, {"large_error"}),
        )
    ),
    ("a motion, then 30 s of standstill", lambda: then_still(30.0), set()),
    ("an encoder that flickers", flickering, set()),
    ("a vertical slide", on_a_slide, set()),
    ("motors at their limit", at_its_limit, set()),
    *((f"a load of {m:g} kg", lambda m=m: loaded(m, 4), set()) for m in (1.0, 3.0)),
]
