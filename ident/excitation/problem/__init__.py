"""The optimisation problem of a design: objective, constraints, and their gradients."""
