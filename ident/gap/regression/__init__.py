"""Weighted regression of the current model, and the score of each candidate beside it."""
