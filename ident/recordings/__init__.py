"""Logs, turned into uniform samples."""
