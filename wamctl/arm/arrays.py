"""Numbers in arrays, as drives, arm, log and simulated arm pass them on."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]
"""Floating-point numbers; shape and unit stand in the docstring of whoever takes or gives them."""
