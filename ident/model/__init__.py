"""The arm and its identified model: data and equations."""
