"""Fleets and watches as a whole: logs in, tables and pages out."""
