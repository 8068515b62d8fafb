"""Rigid bodies: parameters, regressors, base parameters."""
