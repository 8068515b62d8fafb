"""Whether the arm of a URDF can exist, and the nearest one that can."""
