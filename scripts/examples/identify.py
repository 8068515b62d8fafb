"""Arrays in, a model out. Usage: identify.py ARRAYS.npz URDF, with t [s], q [rad], tau, joints."""

import sys

import numpy as np

import ident

data = np.load(sys.argv[1])
joints = [str(name) for name in data["joints"]]
arm = ident.Arm.from_urdf(sys.argv[2], joints=joints)
recording = ident.Recording(data["t"], data["q"], data["tau"], joints=joints)
fit = ident.identify(arm, [recording])
print(fit.verdict, *(remark["sentence"] for remark in fit.remarks))
fit.save("model")
