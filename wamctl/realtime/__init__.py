"""Deadlines, scheduling and how punctual the loop was."""
