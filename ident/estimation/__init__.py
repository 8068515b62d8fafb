"""From a regression to parameters: least squares and physically feasible fits."""
