"""One recording at several cut-offs, two at a time. Usage: sweep.py LOG URDF HZ [HZ ...]."""

import sys
from concurrent.futures import ThreadPoolExecutor

import ident

log, urdf, *cutoffs = sys.argv[1:]
arm = ident.Arm.from_urdf(urdf)
bag = ident.Recording.from_bag(log)
with ThreadPoolExecutor(2) as pool:
    fits = list(pool.map(lambda hz: ident.identify(arm, bag, cutoff_hz=float(hz)), cutoffs))
for hz, fit in zip(cutoffs, fits, strict=True):
    print(f"{hz} Hz: {fit.verdict}, {fit.error_percent:.3g} % on held-out data")
