"""Inverse of a small matrix, in compiled form."""

from numba import njit


@njit(cache=True)
def invert(matrix, out):
    """Inverse of a positive definite matrix by Gauss-Jordan steps; the matrix is used up."""
    n = matrix.shape[0]
    for i in range(n):
        for j in range(n):
            out[i, j] = 1.0 if i == j else 0.0
    for i in range(n):
        pivot = 1.0 / matrix[i, i]
        for c in range(n):
            matrix[i, c] *= pivot
            out[i, c] *= pivot
        for r in range(n):
            factor = matrix[r, i]
            if r != i and factor != 0.0:
                for c in range(n):
                    matrix[r, c] -= factor * matrix[i, c]
                    out[r, c] -= factor * out[i, c]
