"""Recordings of other programs as logs: tables, and a file that says what their columns are."""
