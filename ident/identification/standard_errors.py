"""Standard errors that hold for filtered, autocorrelated rows: by leaving out stretches of time.

Rows after a low-pass repeat each other, so that mse (W^T W)^-1 promises far too much. Here each
stretch, much longer than the filter's memory, is left out in turn; the spread of the solutions is
the error, whatever the correlation inside a stretch and between joints (delete-a-group jackknife).
"""

import numpy as np
from numpy.typing import NDArray

from ident.estimation.regression_data import RegressionData

Array = NDArray[np.floating]

QUANTILE_90 = 1.69
"""Half width of a 90 % interval in standard errors: Student's t with 35 degrees of freedom."""


def standard_errors(evidence: RegressionData, weights: Array | None = None) -> Array:
    """Standard error of each base parameter of the least-squares solution, shape (b,).

    Args:
        evidence: the reduced recordings; all stretches of all logs are left out in turn.
        weights: of each log's and joint's rows, shape (logs, n); None: all alike.
    """
    triangles = evidence.triangles
    if weights is not None:
        triangles = triangles * weights[:, None, :, None, None]
    rows = triangles.reshape(-1, *triangles.shape[-3:])
    used = np.any(rows != 0, axis=(1, 2, 3))
    grams = np.einsum("snij,snik->sjk", rows[used], rows[used])
    scale = np.sqrt(np.einsum("sjj->j", grams)[:-1])
    A = grams[:, :-1, :-1] / np.outer(scale, scale)
    y = grams[:, :-1, -1] / scale
    stretches = len(A)
    without = np.linalg.solve(A.sum(axis=0) - A, (y.sum(axis=0) - y)[..., None])[..., 0]
    spread = without - without.mean(axis=0)
    return np.sqrt((stretches - 1) / stretches * np.sum(spread**2, axis=0)) / scale
