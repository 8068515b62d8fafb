"""Identification by simulation: servo, transmission, and friction from commands and positions."""
