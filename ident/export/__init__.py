"""The identified arm for other programs: URDF, MJCF, and C."""
