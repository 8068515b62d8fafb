"""Recordings with torque, simulated: the recorded torque drives the arm."""
