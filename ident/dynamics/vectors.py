"""Three-vectors as tuples, which the compiler keeps in registers, unlike small arrays."""

from wamctl.arm.compilation import compiled


@compiled
def add(a, b):
    """Sum."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@compiled
def sub(a, b):
    """Difference."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@compiled
def scale(s, a):
    """Scalar times vector."""
    return (s * a[0], s * a[1], s * a[2])


@compiled
def dot(a, b):
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def cross(a, b):
    """Vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@compiled
def row(matrix, i):
    """Row of an array of shape (n, 3)."""
    return (matrix[i, 0], matrix[i, 1], matrix[i, 2])


@compiled
def store(matrix, i, a):
    """Write a row of an array of shape (n, 3)."""
    matrix[i, 0], matrix[i, 1], matrix[i, 2] = a


@compiled
def turned(r, k, a):
    """Rotation r[k] times a; r has shape (n, 3, 3)."""
    return (
        r[k, 0, 0] * a[0] + r[k, 0, 1] * a[1] + r[k, 0, 2] * a[2],
        r[k, 1, 0] * a[0] + r[k, 1, 1] * a[1] + r[k, 1, 2] * a[2],
        r[k, 2, 0] * a[0] + r[k, 2, 1] * a[1] + r[k, 2, 2] * a[2],
    )


@compiled
def turned_back(r, k, a):
    """Transpose of rotation r[k] times a."""
    return (
        r[k, 0, 0] * a[0] + r[k, 1, 0] * a[1] + r[k, 2, 0] * a[2],
        r[k, 0, 1] * a[0] + r[k, 1, 1] * a[1] + r[k, 2, 1] * a[2],
        r[k, 0, 2] * a[0] + r[k, 1, 2] * a[1] + r[k, 2, 2] * a[2],
    )


@compiled
def symmetric(t, i, a):
    """Product with the symmetric tensor stored from t[i] on as xx xy xz yy yz zz."""
    return (
        t[i] * a[0] + t[i + 1] * a[1] + t[i + 2] * a[2],
        t[i + 1] * a[0] + t[i + 3] * a[1] + t[i + 4] * a[2],
        t[i + 2] * a[0] + t[i + 4] * a[1] + t[i + 5] * a[2],
    )
