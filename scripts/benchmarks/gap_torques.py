"""Torques that the blind benchmark of `ident gap` hides, compiled.

Each adds to the torque that the arm feels, or to its friction level [N m]; `s` are its settings.
"""

import numpy as np
from gap_plants import hidden_torque


@hidden_torque
def constant(t, q, qd, load, s, torque, level):
    """Torque s1 on joint s0."""
    torque[int(s[0])] += s[1]


@hidden_torque
def harness(t, q, qd, load, s, torque, level):
    """Cable bundle: s1 (x + s3 x^3), x = q - s2, on joint s0."""
    j = int(s[0])
    x = q[j] - s[2]
    torque[j] += s[1] * (x + s[3] * x * x * x)


@hidden_torque
def drag(t, q, qd, load, s, torque, level):
    """Bent drag on joint s0: s1 times a form s2 of the speed."""
    j = int(s[0])
    v, way = abs(qd[j]), np.sign(qd[j])
    form = int(s[2])
    if form == 0:
        torque[j] += s[1] * way * v * v
    elif form == 1:
        torque[j] += s[1] * way * v**3
    elif form == 2:
        torque[j] += s[1] * way * v**1.7
    elif form == 3:
        torque[j] += s[1] * way * (np.exp(v) - 1.0 - v)
    else:
        level[j] += s[1] * np.sqrt(v)


@hidden_torque
def one_way_drag(t, q, qd, load, s, torque, level):
    """Drag s1 in one direction s2 only, on joint s0."""
    j = int(s[0])
    if qd[j] * s[2] > 0.0:
        torque[j] += s[1] * qd[j]


@hidden_torque
def loaded(t, q, qd, load, s, torque, level):
    """Coulomb level s1 times joint s0's load; form s2: whole, root of squares, driving only."""
    j = int(s[0])
    size = abs(load[j])
    form = int(s[2])
    if form == 1:
        size = np.sqrt(load[j] * load[j] + s[3] * s[3]) - abs(s[3])
    elif form == 2 and load[j] * qd[j] < 0.0:
        size = 0.0
    level[j] += s[1] * size


@hidden_torque
def warming(t, q, qd, load, s, torque, level):
    """Joint s0's Coulomb s1 and viscous s2 change over time s3; s4: exponential, line, root."""
    j = int(s[0])
    form = int(s[4])
    u = t / s[3]
    if form == 0:
        fade = np.exp(-u)
    elif form == 1:
        fade = max(0.0, 1.0 - u)
    else:
        fade = 1.0 / (1.0 + u)
    level[j] += s[1] * fade
    torque[j] += s[2] * fade * qd[j]


@hidden_torque
def cogging(t, q, qd, load, s, torque, level):
    """Harmonics s4.. (size, phase) of motor angle s1 q_a + s2 q_b, joints s0 and s3, order s10."""
    a, b = int(s[0]), int(s[3])
    angle = s[10] * (s[1] * q[a] + s[2] * q[b])
    wave = 0.0
    for h in range(3):
        wave += s[4 + 2 * h] * np.sin((h + 1) * angle + s[5 + 2 * h])
    torque[a] += s[11] * wave
    if s[2] != 0.0:
        torque[b] += s[12] * wave


@hidden_torque
def push(t, q, qd, load, s, torque, level):
    """Half a sine of s1.. on joints up to s0, from time s8 for s9 seconds."""
    u = (t - s[8]) / s[9]
    if u > 0.0 and u < 1.0:
        for j in range(int(s[0]) + 1):
            torque[j] += s[1 + j] * np.sin(np.pi * u)


@hidden_torque
def stop(t, q, qd, load, s, torque, level):
    """One-sided stop on joint s0 beyond angle s1 (side s2): stiffness s3, power s4."""
    j = int(s[0])
    depth = (q[j] - s[1]) * s[2]
    if depth > 0.0:
        torque[j] += s[2] * s[3] * depth ** s[4]


@hidden_torque
def rubbing(t, q, qd, load, s, torque, level):
    """Friction of joint s0 by its position: Coulomb s1, viscous s2, wave number s3, phase s4."""
    j = int(s[0])
    wave = np.sin(s[3] * q[j] + s[4])
    level[j] += s[1] * wave
    torque[j] += s[2] * (1.0 + wave) * qd[j]


@hidden_torque
def odd_wave(t, q, qd, load, s, torque, level):
    """Torque on joint s0 that repeats with its own angle, wave number s2: s1 sin(s2 q + s3)."""
    j = int(s[0])
    torque[j] += s[1] * np.sin(s[2] * q[j] + s[3])


@hidden_torque
def cross_talk(t, q, qd, load, s, torque, level):
    """Torque on joint s0 from joint s1: position s2, velocity s3, product of velocities s4."""
    i, j = int(s[0]), int(s[1])
    torque[i] += s[2] * q[j] + s[3] * qd[j] + s[4] * qd[i] * qd[j]


@hidden_torque
def beat(t, q, qd, load, s, torque, level):
    """Torque on joint s0 that repeats in time: s1 sin(s2 t + s3)."""
    torque[int(s[0])] += s[1] * np.sin(s[2] * t + s[3])


@hidden_torque
def stiffening(t, q, qd, load, s, torque, level):
    """Hard cubic spring about s2 on joint s0, no linear part."""
    j = int(s[0])
    torque[j] += s[1] * (q[j] - s[2]) ** 3
