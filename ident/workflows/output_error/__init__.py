"""Identification by simulation as a whole: logs in, result files and report out."""
